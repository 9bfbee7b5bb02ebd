/* SPDX-License-Identifier: BSD-3-Clause */
/* The rename at the end is atomic on POSIX file systems, so a reader sees the old file or the new
 * one. Devices and pipes are refused: renaming over /dev/null would replace it. */
#include "output.h"

#include "report.h"

#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Read by the signal handler: the temporary file to remove, or NULL. */
static char *volatile pending = NULL;

static void remove_pending(int signal_number) {
    if (pending != NULL) {
        unlink(pending);
    }
    signal(signal_number, SIG_DFL);
    raise(signal_number);
}

static void watch_signals(void) {
    static const int fatal[] = {SIGINT, SIGTERM, SIGHUP, SIGPIPE};
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = remove_pending;
    sigemptyset(&action.sa_mask);
    for (size_t i = 0; i < sizeof fatal / sizeof fatal[0]; i++) {
        struct sigaction old;
        if (sigaction(fatal[i], NULL, &old) == 0 && old.sa_handler == SIG_DFL) {
            sigaction(fatal[i], &action, NULL);
        }
    }
}

static bool is_standard_output(const char *path) {
    return strcmp(path, "-") == 0;
}

bool output_check(const char *path) {
    struct stat status;
    if (is_standard_output(path)) {
        return true;
    }
    if (path[0] == '\0' || strlen(path) + sizeof ".XXXXXX" > PATH_MAX) {
        report_failure("%s: the path is empty or too long", path);
        return false;
    }
    if (stat(path, &status) == 0 && !S_ISREG(status.st_mode)) {
        report_failure("%s: is there already and is not a regular file", path);
        return false;
    }
    char folder[PATH_MAX] = ".";
    const char *slash = strrchr(path, '/');
    if (slash != NULL) {
        const size_t length = slash == path ? 1 : (size_t)(slash - path);
        memcpy(folder, path, length);
        folder[length] = '\0';
    }
    if (access(folder, W_OK | X_OK) != 0) {
        report_failure("%s: cannot write to the folder: %s", path, strerror(errno));
        return false;
    }
    return true;
}

bool output_same(const char *a, const char *b) {
    struct stat status_a;
    struct stat status_b;
    if (strcmp(a, b) == 0) {
        return true;
    }
    return stat(a, &status_a) == 0 && stat(b, &status_b) == 0 &&
           status_a.st_dev == status_b.st_dev && status_a.st_ino == status_b.st_ino;
}

bool output_open(output_file *output, const char *path) {
    output->path = path;
    output->temporary[0] = '\0';
    if (is_standard_output(path)) {
        output->file = stdout;
        return true;
    }
    output->file = NULL;
    if (!output_check(path)) {
        return false;
    }
    snprintf(output->temporary, sizeof output->temporary, "%s.XXXXXX", path);
    watch_signals();
    /* between the making of the file and the note of it no signal may come: it would leave the file
     */
    sigset_t all, before;
    sigfillset(&all);
    sigprocmask(SIG_BLOCK, &all, &before);
    const int descriptor = mkstemp(output->temporary);
    const int reason = errno;
    pending = descriptor >= 0 ? output->temporary : NULL;
    sigprocmask(SIG_SETMASK, &before, NULL);
    if (descriptor < 0) {
        output->temporary[0] = '\0';
        report_failure("%s: cannot create: %s", path, strerror(reason));
        return false;
    }
    /* mkstemp() makes private files; an output has the permissions of any other new file */
    const mode_t mask = umask(0);
    umask(mask);
    output->file = fchmod(descriptor, 0666 & ~mask) == 0 ? fdopen(descriptor, "wb") : NULL;
    if (output->file == NULL) {
        report_failure("%s: cannot create: %s", path, strerror(errno));
        close(descriptor);
        output_abandon(output);
        return false;
    }
    return true;
}

bool output_finish(output_file *output) {
    FILE *file = output->file;
    output->file = NULL;
    bool good = fflush(file) == 0 && ferror(file) == 0;
    if (file != stdout) {
        good = fclose(file) == 0 && good;
    }
    if (!good) {
        report_failure("%s: cannot write: %s",
                       is_standard_output(output->path) ? "standard output" : output->path,
                       strerror(errno));
        output_abandon(output);
    }
    return good;
}

bool output_publish(output_file *output) {
    if (output->temporary[0] == '\0') {
        return true;
    }
    if (rename(output->temporary, output->path) != 0) {
        report_failure("%s: cannot rename: %s", output->path, strerror(errno));
        output_abandon(output);
        return false;
    }
    pending = NULL;
    output->temporary[0] = '\0';
    return true;
}

void output_abandon(output_file *output) {
    if (output->file != NULL && output->file != stdout) {
        fclose(output->file);
    }
    output->file = NULL;
    if (output->temporary[0] != '\0') {
        unlink(output->temporary);
        pending = NULL;
        output->temporary[0] = '\0';
    }
}
