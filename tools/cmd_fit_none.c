/* SPDX-License-Identifier: BSD-3-Clause */
/* `shcd fit` in a build without libshcd-fit: the options are still checked, then it refuses. */
#include "arguments.h"
#include "commands.h"
#include "report.h"

const char command_fit_build[] = "without libshcd-fit: 'shcd fit' is not available";

int command_fit(int argc, char **argv) {
    arguments a;
    int key;
    arguments_begin(&a, argc, argv);
    while ((key = arguments_next(&a)) > 0) {
    }
    if (key != ARGUMENTS_END) {
        return arguments_status(key);
    }
    return report_failure("this build has no libshcd-fit (it was configured with "
                          "SHCD_BUILD_FIT=OFF), so meshes cannot be fitted");
}
