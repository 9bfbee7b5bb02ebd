/* SPDX-License-Identifier: BSD-3-Clause */
/* `shcd fit`, `shcd modes` and `shcd train` in a build without libshcd-fit: the options are still
 * checked, then it refuses. */
#include "arguments.h"
#include "commands.h"
#include "report.h"

const char command_fit_build[] =
    "without libshcd-fit: 'shcd fit', 'shcd modes' and 'shcd train' are not available";

/* Returns an exit status. */
static int refuse(int argc, char **argv, const char *what) {
    arguments a;
    int key;
    arguments_begin(&a, argc, argv);
    while ((key = arguments_next(&a)) > 0) {
    }
    if (key != ARGUMENTS_END) {
        return arguments_status(key);
    }
    return report_failure("this build has no libshcd-fit (it was configured with "
                          "SHCD_BUILD_FIT=OFF), so %s",
                          what);
}

int command_fit(int argc, char **argv) {
    return refuse(argc, argv, "meshes cannot be fitted");
}

int command_modes(int argc, char **argv) {
    return refuse(argc, argv, "modes cannot be computed");
}

int command_train(int argc, char **argv) {
    return refuse(argc, argv, "nothing can be trained");
}
