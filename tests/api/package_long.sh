#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The Debian package in a system of its own: a fresh Debian in a directory, its systemd booted in
# namespaces of its own (see _boot.sh). Installed, used, killed, backed up, restored as OPERATING.md says,
# upgraded, removed, purged.
. "$(dirname "$0")/_lib.sh"
PATH=$PATH:/usr/sbin:/sbin
if [ "$(id -u)" -ne 0 ]; then
    echo "1..1"
    echo "ok 1 - # SKIP a system cannot be booted by who is not root"
    exit 0
fi
root=$T/root
BOOT=
cleanup() {
    if [ -n "$BOOT" ]; then
        kill -9 "$BOOT" 2>/dev/null
        wait "$BOOT" 2>/dev/null
        for group in $(find "$(findmnt -n -t cgroup2 -o TARGET | head -n 1)/bcdd-test-$BOOT" -depth -type d); do
            tries=0
            until rmdir "$group" 2>/dev/null || [ $tries -ge 20 ]; do
                sleep 0.1
                tries=$((tries + 1))
            done
        done
    fi
    rm -rf "$T"
}
inside() {
    nsenter -t "$INIT" -a --root --wd=/ env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin "$@"
}
files() { # what there is, without what lives there
    (cd "$root" && find . -xdev \( -path ./var/lib/dpkg -o -path ./etc/.pwd.lock -o -path ./var/log -o -path ./var/cache -o -path ./run \
        -o -path ./root -o -path ./srv -o -path ./tmp -o -path ./var/tmp -o -path ./var/lib/systemd \) -prune -o -print | sort)
}

check "make deb" make --no-print-directory B="$B" deb
deb=$(find "$B/deb" -name '*.deb')
depends=$(dpkg-deb -f "$deb" Depends | sed 's/ *([^)]*)//g; s/ *|[^,]*//g; s/, /,/g')
check "it depends on what it is linked with" sh -c "
    for library in libmicrohttpd libjansson libsqlite3 libgsl libmd libcurl; do
        echo '$depends' | grep -q \$library || exit 1
    done"
check "a fresh Debian" mmdebstrap --quiet --variant=apt \
    --include="$depends,systemd-sysv,curl,jq" bookworm "$root"
sh tests/api/_boot.sh "$root" >"$T/console" 2>&1 &
BOOT=$!
INIT=
tries=0
while [ $tries -lt 300 ]; do
    # The child of `unshare`, which is what the script has become.
    INIT=$(cut -d ' ' -f 1 "/proc/$BOOT/task/$BOOT/children" 2>/dev/null)
    [ -n "$INIT" ] && inside systemctl is-system-running 2>/dev/null | grep -Eq 'running|degraded' && break
    sleep 0.1
    tries=$((tries + 1))
done
check "boots" inside systemctl is-active multi-user.target
cp "$deb" "$root/srv/bcdd.deb"
files >"$T/before"

# ---- installed
check "dpkg -i" inside dpkg -i /srv/bcdd.deb
check "the service runs" inside systemctl is-active bcdd
check "and will after the next boot" inside systemctl is-enabled bcdd bcdd-backup.timer bcdd-log.timer
check "timers wait" inside systemctl is-active bcdd-backup.timer bcdd-log.timer
curl_inside() {
    inside curl -sS -m 20 "$@"
}
get() { # PATH FILE
    curl_inside -f "http://127.0.0.1:8080$1" >"$2"
}
check "it is ready" get /readyz "$T/ready"
main=$(inside systemctl show -P MainPID bcdd)
status=$T/status
inside cat "/proc/$main/status" >"$status"
has() {
    grep -qE "^$1:[[:space:]]+$2" "$status"
}
check "it is nobody of this system but bcdd" test "$(inside stat -c %U "/proc/$main")" = bcdd
check "without capabilities" has CapBnd 0000000000000000
check "and ways to get any" has NoNewPrivs 1
check "its system calls are filtered" has Seccomp 2
check "workers give way" test "$(inside sh -c "cut -d ' ' -f 19 /proc/$main/task/*/stat" | sort -nu | tail -n 1)" -ge 5
check "the log is in the journal" inside sh -c \
    "journalctl -u bcdd -o cat | grep -q 'event=listening host=127.0.0.1 port=8080'"
check "manual pages, completions, page and example are there" inside test -s /usr/share/man/man8/bcdd.8.gz -a \
    -s /usr/share/doc/bcdd/OPERATING.md -a -s /usr/share/doc/bcdd/examples/nginx.conf -a \
    -s /usr/share/bash-completion/completions/bcd

# ---- used: the same bits as without a service
scene() { # SEED TIME
    printf '{"particles":20,"length":40,"diameter":0.5,"time":%s,"time_step":0.001,"seed":%s,' "$2" "$1"
    printf '"realizations":4,"potential":{"type":"cosine","amplitude":6},"observables":{"energy":{},'
    printf '"density":{"bins":20}}}'
}
submit() { # FILE: sets ID
    cp "$1" "$root/srv/job.json"
    ID=$(curl_inside -f http://127.0.0.1:8080/v1/jobs --data-binary @/srv/job.json | jq -r .id)
}
ended() { # ID
    for try in 1 2 3 4; do
        [ "$(curl_inside "http://127.0.0.1:8080/v1/jobs/$1?wait=20" | jq -r .state)" = done ] && return
    done
    return 1
}
same_bits() { # ID JOB
    get "/v1/jobs/$1/results" "$T/theirs" && "$B/bcd" run "$2" 2>"$T/err" >"$T/ours" &&
        jq -S . "$T/ours" >"$T/ours.sorted" && jq -S . "$T/theirs" | cmp - "$T/ours.sorted"
}
scene 1 5 >"$T/short.json"
scene 2 400 >"$T/long.json"
submit "$T/short.json"
short=$ID
check "a job is done" ended "$short"
check "with the same bits as here" same_bits "$short" "$T/short.json"

# ---- killed
submit "$T/long.json"
long=$ID
sleep 1
check "kill -9" inside systemctl kill -s KILL bcdd
tries=0
until get /healthz "$T/health" 2>/dev/null || [ $tries -ge 150 ]; do
    sleep 0.1
    tries=$((tries + 1))
done
check "it is back by itself" get /healthz "$T/health"
check "the job goes on" ended "$long"
check "to the same bits" same_bits "$long" "$T/long.json"

# ---- backed up and restored
check "a backup" inside systemctl start bcdd-backup
check "is there" test "$(find "$root/var/backups/bcdd" -name 'bcd-*.sqlite' | wc -l)" = 1
check "the look through the log, for errors" inside systemctl start bcdd-log
inside systemctl stop bcdd
rm -r "$root/var/lib/bcdd"
inside install -d -m 700 -o bcdd -g bcdd /var/lib/bcdd
inside sh -c 'install -m 600 -o bcdd -g bcdd /var/backups/bcdd/bcd-*.sqlite /var/lib/bcdd/bcd.sqlite'
token=$(inside runuser -u bcdd -- bcdd token create --data /var/lib/bcdd --owner root --role admin 2>"$T/err")
inside systemctl start bcdd
check "restored, with the first token: nobody gets in without" test \
    "$(curl_inside -o /dev/null -w '%{http_code}' http://127.0.0.1:8080/v1/jobs)" = 401
get_as_admin() {
    inside curl -sSf -m 20 -H "Authorization: Bearer $token" "http://127.0.0.1:8080$1" >"$2"
}
check "and with it to what there was" get_as_admin "/v1/jobs/$long/results" "$T/again"
check "the same bytes" cmp "$T/again" "$T/theirs"

# ---- upgraded, removed, purged
sed -i 's/^#BCDD_OPTIONS=.*/BCDD_OPTIONS="--workers 1"/' "$root/etc/default/bcdd"
before=$(inside systemctl show -P MainPID bcdd)
check "the package once more, as an upgrade" inside dpkg -i /srv/bcdd.deb
check "it was restarted" test "$(inside systemctl show -P MainPID bcdd)" != "$before"
check "with the options that were set" inside sh -c \
    "tr '\\0' ' ' </proc/\$(systemctl show -P MainPID bcdd)/cmdline | grep -q -- '--workers 1'"
check "results are still there" get_as_admin "/v1/jobs/$long/results" "$T/again"
check "removed" inside dpkg -r bcdd
check "it ended" inside sh -c '! curl -s -m 2 http://127.0.0.1:8080/healthz'
check "options and data stay" test -s "$root/etc/default/bcdd" -a -s "$root/var/lib/bcdd/bcd.sqlite"
check "purged" inside dpkg -P bcdd
files >"$T/after"
diff "$T/before" "$T/after" | sed -n 's/^> //p' >"$T/left"
check "what is left are results and backups" sh -c "! grep -vE '^[.]/var/(lib|backups)/bcdd(/|\$)|^[.]/etc/[a-z]*-?\$' '$T/left'"
check "and they are" test -s "$root/var/lib/bcdd/bcd.sqlite"
check "dpkg knows nothing of it" inside sh -c '! dpkg -s bcdd'
finish
