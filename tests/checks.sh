#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# What ./check and ./check-drivers share: sections, and counting tests as ctest saw them. Sourced, after $root and $reports are set.
set -uo pipefail

passed=0
failed=0
skipped=0
failures=()
started=$SECONDS
under=() # a command that tests are run by, e.g. tests/drivers/with zink

section() {
    local elapsed=$((SECONDS - started))
    printf '\n== %s (+%d:%02d) %s\n' "$(date +%H:%M:%S)" $((elapsed / 60)) $((elapsed % 60)) "$*"
}

count_failure() {
    failed=$((failed + 1))
    failures+=("$1")
}

count_skip() {
    skipped=$((skipped + 1))
    echo "skipped: $1"
}

# Prints the summary line last, however we end.
finish() {
    section "summary"
    [ ${#failures[@]} -eq 0 ] || printf 'FAILED: %s\n' "${failures[@]}"
    echo "$passed passed, $failed failed, $skipped skipped"
    [ "$failed" -eq 0 ] || exit 1
    exit 0
}

# A step that is no test: only its failure counts, and ends the run.
must() {
    local name=$1
    shift
    "$@" && return 0
    count_failure "$name"
    finish
}

# A check that is no test of ctest's. 77: skipped, it said why.
count_check() { # NAME COMMAND...
    local name=$1 status=0
    shift
    "$@" || status=$?
    case $status in
    0) passed=$((passed + 1)) ;;
    77) skipped=$((skipped + 1)) && echo "skipped: $name" ;;
    *) count_failure "$name" ;;
    esac
}

# Counts the tests of a report; STATUS is how ctest ended.
count_report() { # NAME REPORT STATUS
    local name=$1 report=$2 status=$3 before=$failed seen=0 verdict line
    [ -f "$report" ] || {
        count_failure "$name: ctest wrote no report"
        return
    }
    while IFS=$'\t' read -r verdict line; do
        seen=$((seen + 1))
        case $verdict in
        passed) passed=$((passed + 1)) ;;
        skipped) skipped=$((skipped + 1)) && echo "skipped: $line" ;;
        *) count_failure "$name: $line" ;;
        esac
    done < <(python3 "$root/tests/style/junit_verdicts.py" "$report")
    [ "$seen" -gt 0 ] || count_failure "$name: the report of ctest cannot be read"
    [ "$status" -eq 0 ] || [ "$failed" -gt "$before" ] ||
        count_failure "$name: ctest ended with status $status"
}

run_tests() { # NAME BUILD_DIR CTEST_ARGUMENTS...
    local name=$1 dir=$2 report=$reports/$1.xml status=0
    shift 2
    rm -f "$report"
    "${under[@]}" ctest --test-dir "$dir" --no-tests=error --output-on-failure \
        --output-junit "$report" "$@" || status=$?
    count_report "$name" "$report" "$status"
}

configure() { # PRESET ARGUMENTS...
    local linker=
    ! command -v mold >/dev/null || linker=mold
    (cd "$root" && cmake --preset "$@" "-DVITRAIL_LINKER=$linker") >"$reports/configure-$1.log" 2>&1 || {
        cat "$reports/configure-$1.log"
        return 1
    }
}

compile() { # BUILD_DIR ARGUMENTS...
    cmake --build "$@" -- --quiet
}
