#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Runs a command in a private network namespace: netns.sh CMD [ARGUMENT...]
#
# LCM talks by UDP multicast. In here there is only a loopback device, so nothing leaves the machine
# or comes in, and two runs at once do not hear each other. Exit status: the command's; 77, which
# ctest reports as skipped, where the kernel refuses such a namespace; 2 for bad usage.
set -eu
PATH=$PATH:/usr/sbin:/sbin # ip(8) is not on the path of a plain Debian user

if [ $# -eq 0 ]; then
    echo "usage: netns.sh COMMAND [ARGUMENT...]" >&2
    exit 2
fi
for tool in unshare ip; do
    if ! command -v "$tool" >/dev/null; then
        echo "netns.sh: $tool is missing; install util-linux and iproute2" >&2
        exit 77
    fi
done

# Root needs no user namespace; in a container root may lack the right for the first but not for
# the second. -r maps the caller to root inside, which the set-up of the device needs.
flags=
for candidate in -n -rn; do
    if unshare $candidate true 2>/dev/null; then
        flags=$candidate
        break
    fi
done
if [ -z "$flags" ]; then
    {
        echo "netns.sh: no private network namespace for $(id -un) here."
        if [ "$(id -u)" -ne 0 ]; then
            echo "  Run the command as root, or let root change what forbids it to users:"
        fi
        for setting in kernel.unprivileged_userns_clone=1 \
            kernel.apparmor_restrict_unprivileged_userns=0 user.max_user_namespaces=15000; do
            file=/proc/sys/$(echo "${setting%=*}" | tr . /)
            value=$(cat "$file" 2>/dev/null || echo "${setting#*=}")
            case $setting:$value in
            *=1:0 | *=0:1 | *=15000:0) echo "    sysctl -w $setting" ;;
            esac
        done
        echo "  In a container its manager must allow it, as docker run --cap-add SYS_ADMIN does."
    } >&2
    exit 77
fi

# shellcheck disable=SC2016 # expanded by the inner shell
exec unshare $flags -- sh -c '
    if ! { ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo; }; then
        echo "netns.sh: cannot set up the loopback device of the namespace" >&2
        exit 77
    fi
    LCM_DEFAULT_URL="udpm://239.255.76.67:7667?ttl=0"
    export LCM_DEFAULT_URL
    exec "$@"' sh "$@"
