# SPDX-License-Identifier: GPL-3.0-or-later
# _digest.sh - jobs of every method, potential and interaction, and what they measured, to the bit.
# Read with `.` by the others, after T (a directory for what is made here) is set.
#
#   digest_jobs all|some     writes $T/jobs/*.json
#   digest_measure BCD DIR   runs them with the program BCD; what they measured goes to DIR/*.out
#   digest_same A B          the names of all outputs that differ between two such directories
#
# What is compared: every number that was measured. Not compared: exact references and what is
# judged by them, for they come from libm and GSL, which may differ in the last digits.

# One job for each method: $1 = name, $2 = what it is, $3 = observables. Some: of every scene bcd,
# of two scenes every method, and bonds.
digest_body() {
    for method in engine/methods/*.c; do
        method=${method##*/}
        method=${method%.c}
        case $DIGEST_EXTENT,$1,$method in
        all,* | some,cosine,* | some,sparse,* | some,*,bcd | some,bonds,strang_bonds) ;;
        *) continue ;;
        esac
        printf '{"method":"%s","seed":9007199254740991,"observables":{%s},%s}\n' "$method" \
            "$3" "$2" >"$T/jobs/$1.$method.json"
    done
}

digest_jobs() {
    DIGEST_EXTENT=$1
    mkdir -p "$T/jobs"
    all='"msd":{"points":6},"density":{"bins":9},"energy":{},"current":{},"cluster_sizes":{},
        "contact_density":{"bins":5},"pair_distribution":{"bins":7},"trajectory":{"every":0.01}'
    static='"density":{"bins":9},"contact_density":{"bins":5},"energy":{}'
    cosine='"potential":{"type":"cosine","amplitude":6,"phase":0.3}'
    digest_body cosine '"particles":37,"length":60,"diameter":0.8,"force":1,"time_step":1e-3,
        "time":0.6,"realizations":2,'"$cosine" "$all"
    digest_body sparse '"particles":1000,"length":2000,"diameter":0.5,"time_step":1e-3,"time":0.02,
        '"$cosine" "$static"
    digest_body dense '"particles":300,"length":300,"diameter":0.99,"time_step":1e-4,"time":0.02,
        "initial":"lattice",'"$cosine" "$static"
    digest_body auto '"particles":12,"length":20,"diameter":0.5,"time":0.2,
        "initial":"equilibrium","potential":{"type":"cosine","amplitude":3}' "$static"
    digest_body free '"particles":20,"length":20,"diameter":0.7,"time_step":1e-3,"time":0.4,
        "realizations":3' "$static"
    digest_body walls '"particles":9,"length":11,"diameter":0.8,"boundary":"walls","force":2,
        "time_step":1e-3,"time":0.4,"potential":{"type":"expression",
        "energy":"(x-3)^2/2 + exp(sin(x)) + log(1+x) + x^1.7 + tanh(cos(x))"}' "$static"
    digest_body fourier '"particles":7,"length":8,"diameter":0.9,"time_step":1e-4,"time":0.04,
        "potential":{"type":"fourier","cosine":[1,0.2],"sine":[0,0.5]}' "$static"
    digest_body sticky '"particles":16,"length":24,"diameter":0.7,"time_step":1e-5,"time":0.01,
        "interaction":{"type":"sticky","strength":0.2,"range":0.1},'"$cosine" "$static"
    digest_body bonds '"particles":16,"length":24,"diameter":0.7,"time_step":1e-3,"time":0.2,
        "interaction":{"type":"sticky","strength":0.5,"range":0},'"$cosine" "$static"
    digest_body yukawa '"particles":16,"length":24,"diameter":0.5,"time_step":5e-4,"time":0.1,
        "potential":{"type":"table","period":2,"values":[1,0.2,-1,-0.1]},"interaction":
        {"type":"yukawa","strength":1,"screening":2,"cutoff":1.5}' "$static"
    digest_body power '"particles":16,"length":24,"diameter":0.5,"time_step":5e-4,"time":0.1,
        "interaction":{"type":"power","strength":1,"exponent":3.5,"cutoff":1.2}' "$static"
    digest_body curve '"particles":16,"length":24,"diameter":0.5,"time_step":5e-4,"time":0.1,
        "interaction":{"type":"table","first":0.5,"last":1.2,"values":[2,1,0.3,0]}' "$static"
    digest_body formula '"particles":16,"length":24,"diameter":0.5,"time_step":5e-4,"time":0.1,
        "interaction":{"type":"expression","energy":"exp(-2*r)/r","cutoff":1.4}' "$static"
}

# Methods may refuse a scene; then the refusal is compared.
digest_measure() {
    mkdir -p "$2"
    for job in "$T"/jobs/*.json; do
        name=${job##*/}
        "$1" run --quiet "$job" >"$T/result" 2>"$T/refused" || {
            grep -q '/method' "$T/refused" || echo "$name: $(cat "$T/refused")"
            echo refused >"$2/${name%.json}.out"
            continue
        }
        jq -cS 'map_values(del(.theory, .theory_reason, .z, .chi_square, .p_value,
                               .degrees_of_freedom))' "$T/result" >"$2/${name%.json}.out"
    done
}

digest_same() {
    for one in "$1"/*.out; do
        cmp -s "$one" "$2/${one##*/}" || echo "${one##*/}"
    done
}
