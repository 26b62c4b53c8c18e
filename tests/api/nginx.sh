#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# deploy/nginx.conf in front of a daemon, on loopback, with a certificate made for the occasion: what an
# operator fills in is filled in, all else is as it stands there.
. "$(dirname "$0")/_lib.sh"
PATH=$PATH:/usr/sbin
PROXY=
cleanup() {
    [ -z "$PROXY" ] || kill "$PROXY" 2>/dev/null
    [ -z "$PID" ] || kill -9 "$PID" 2>/dev/null
    rm -rf "$T"
}

name=lab.example.org
openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj "/CN=$name" -addext "subjectAltName=DNS:$name" \
    -keyout "$T/key.pem" -out "$T/cert.pem" 2>"$T/openssl"
"$B/bcdd" token create --data "$T/data" --owner root --role admin >"$T/token" 2>"$T/said"
AUTH="Authorization: Bearer $(cat "$T/token")"
daemon_start "$T/data" --workers 1 --host-name $name --auth required
backend=$URL

# Two ports that nobody has now; another try when somebody was faster.
free_ports() {
    node -e 'const n = require("net"), s = [0, 1].map(() => n.createServer().listen(0, "127.0.0.1"));
        setTimeout(() => { console.log(s.map((x) => x.address().port).join(" ")); process.exit() }, 50)'
}
mkdir "$T/nginx"
cat >"$T/nginx.conf" <<CONF
daemon off;
pid $T/nginx/pid;
error_log stderr;
events { worker_connections 512; }
http {
    access_log $T/nginx/access;
    client_body_temp_path $T/nginx/body;
    proxy_temp_path $T/nginx/proxy;
    fastcgi_temp_path $T/nginx/fastcgi;
    uwsgi_temp_path $T/nginx/uwsgi;
    scgi_temp_path $T/nginx/scgi;
    include $T/site.conf;
}
CONF
# Whoever starts as root works as nobody of this machine who may read the test's directory.
[ "$(id -u)" -ne 0 ] || sed -i '1i user root;' "$T/nginx.conf"
for try in 1 2 3; do
    ports=$(free_ports)
    plain=${ports% *} tls=${ports#* }
    sed "s|127.0.0.1:8080|${backend#http://}|; s|listen 80;|listen 127.0.0.1:$plain;|
        s|listen 443 |listen 127.0.0.1:$tls |; s|/etc/ssl/certs/$name.pem|$T/cert.pem|
        s|/etc/ssl/private/$name.key|$T/key.pem|" deploy/nginx.conf >"$T/site.conf"
    nginx -t -c "$T/nginx.conf" >"$T/test" 2>&1
    TEST=$?
    nginx -c "$T/nginx.conf" 2>"$T/nginx/err" &
    PROXY=$!
    while kill -0 "$PROXY" 2>/dev/null; do
        curl -s -o /dev/null -m 10 "http://127.0.0.1:$plain/" && break 2
        sleep 0.1
    done
    kill "$PROXY" 2>/dev/null
done
check "nginx -t: the example is taken" test "$TEST" = 0
check "without a warning" sh -c "! grep -E 'warn|emerg' '$T/test'"
check "there is nothing left to fill in" sh -c "! grep -E '^[^#]*(8080|/etc/)' '$T/site.conf'"

URL=https://$name:$tls
proxied() { # METHOD PATH [curl ...]
    ask "$@" --resolve "$name:$tls:127.0.0.1" --cacert "$T/cert.pem"
}
proxied GET /healthz
check "a request over TLS" status_is 200
check "and HTTP/2" grep -q '^HTTP/2 200' "$T/head"
check "browsers stay with TLS" header_is strict-transport-security max-age=31536000
check "the daemon's own headers come through, once" test "$(grep -ic '^x-content-type-options: nosniff' "$T/head")" = 1
check "its request id" grep -qi '^x-request-id: .' "$T/head"
proxied GET /healthz -H 'X-Request-Id: mine-7'
check "the client's one, too" header_is x-request-id mine-7
proxied GET /healthz --http1.1
check "HTTP/1.1 as well" grep -q '^HTTP/1.1 200' "$T/head"
STATUS=$(curl -sS -m 60 -o /dev/null -D "$T/head" -w '%{http_code}' -H "Host: $name" "http://127.0.0.1:$plain/v1/jobs?limit=1")
check "without TLS one is sent there" test "$STATUS $(tr -d '\r' <"$T/head" | grep -i '^location')" = \
    "308 Location: https://$name/v1/jobs?limit=1"
STATUS=$(curl -sS -m 60 -o "$T/body" -w '%{http_code}' -k "https://127.0.0.1:$tls/healthz" -H 'Host: elsewhere.org')
check "another name is refused by the daemon" status_is 421

JOB='{"particles":50,"length":100,"diameter":0.5,"time":1e5,"realizations":2,
    "observables":{"msd":{"first":0.01,"last":1,"points":5}}}'
proxied POST /v1/jobs -d "$JOB"
check "without a token nobody submits" status_is 401
proxied POST /v1/jobs -d "$JOB" -H "$AUTH" -H "Origin: https://$name:$tls"
check "with one, from the server's own page" status_is 202
ID=$(jq -r .id "$T/body")
check "the address of the job is the path alone" grep -qi "^location: /v1/jobs/$ID" "$T/head"
proxied POST /v1/jobs -d "$JOB" -H "$AUTH" -H "Origin: https://evil.example"
check "not from another's page" status_is 403
head -c 1100000 /dev/zero | tr '\0' ' ' >"$T/large"
proxied POST /v1/jobs --data-binary "@$T/large" -H "$AUTH"
check "a body that is too large" status_is 413
proxied GET /metrics -H "$AUTH"
check "metrics for this machine" status_is 200

# An event stream arrives as it happens: the first event long before the job's end.
curl -sN -m 250 --resolve "$name:$tls:127.0.0.1" --cacert "$T/cert.pem" -H "$AUTH" \
    "$URL/v1/jobs/$ID/events" >"$T/events" 2>/dev/null &
stream=$!
check "progress comes while the job runs" eventually grep -q '^event: progress' "$T/events"
check "and nothing else yet" sh -c "! grep '^event: done' '$T/events'"
proxied DELETE "/v1/jobs/$ID" -H "$AUTH"
wait $stream
check "its end comes at once, and ends the stream" test "$? $(grep -c '^event: done' "$T/events")" = "0 1"
daemon_end TERM
proxied GET /healthz
check "no daemon: 502, not a page of it" status_is 502
kill "$PROXY"
wait "$PROXY"
check "nginx ends well" test $? = 0
PROXY=
finish
