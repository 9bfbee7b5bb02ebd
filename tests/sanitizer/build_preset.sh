#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Configures and builds a preset: build_preset.sh PRESET [CMAKE_ARGUMENT...]
set -eu
preset=$1
shift
cmake --preset "$preset" "$@"
cmake --build --preset "$preset"
