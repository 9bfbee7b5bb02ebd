#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Stands in for shcdd: runs it (SHCDD) with every system call of every thread written to SHCDD_TRACE.
# -D: the process itself becomes shcdd, so signals and waiting go to it and not to the tracer.
exec strace -D -f -y -o "$SHCDD_TRACE" "$SHCDD" "$@"
