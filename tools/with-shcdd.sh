#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Runs a command while a daemon serves: with-shcdd.sh SHCDD SCENE LOG COMMAND [ARGUMENT...]
#
# For use inside netns.sh. SHCDD may be followed by options in the same word. Nothing is left
# running, however this ends. Exit status: the command's, or 1 if the daemon did not end well.
set -eu
if [ $# -lt 4 ]; then
    echo "usage: with-shcdd.sh SHCDD SCENE LOG COMMAND [ARGUMENT...]" >&2
    exit 2
fi
shcdd=$1
scene=$2
log=$3
shift 3

daemon=
client=
stop_all() {
    for process in $client $daemon; do
        kill "$process" 2>/dev/null || true
    done
    wait
}
trap stop_all EXIT
trap 'exit 129' HUP
trap 'exit 130' INT
trap 'exit 143' TERM

# Both in the background: a shell that waits in the foreground would not see signals.
# shellcheck disable=SC2086 # options in the same word
$shcdd "$scene" >"$log" 2>&1 &
daemon=$!
"$@" &
client=$!
status=0
wait "$client" || status=$?
client=

ended=0
kill "$daemon" 2>/dev/null || true
wait "$daemon" || ended=$?
daemon=
if [ "$ended" -ne 0 ]; then
    echo "with-shcdd.sh: the daemon ended with status $ended:" >&2
    tail -n 5 "$log" >&2
    [ "$status" -ne 0 ] || status=1
fi
exit "$status"
