/* SPDX-License-Identifier: BSD-3-Clause */
/* gnuplot gets a program with its data on its standard input; the picture comes on its standard
 * output. Ordinary files on both sides: no pipe that could break, no name that would need quotes.
 */
#include "gnuplot.h"

#include "report.h"

#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static bool ends_with(const char *text, const char *end) {
    const size_t n = strlen(text), n_end = strlen(end);
    return n > n_end && strcmp(text + n - n_end, end) == 0;
}

enum gnuplot_format gnuplot_format_of(const char *path) {
    return ends_with(path, ".svg")   ? GNUPLOT_SVG
           : ends_with(path, ".png") ? GNUPLOT_PNG
                                     : GNUPLOT_UNKNOWN;
}

bool gnuplot_check(void) {
    const char *folder = getenv("PATH");
    while (folder != NULL && *folder != '\0') {
        char path[PATH_MAX];
        const size_t length = strcspn(folder, ":");
        snprintf(path, sizeof path, "%.*s/gnuplot", (int)length, folder);
        if (access(path, X_OK) == 0) {
            return true;
        }
        folder += length + (folder[length] == ':' ? 1 : 0);
    }
    report_failure("--plot needs gnuplot, which is not in the PATH");
    return false;
}

/* Text of a string in double quotes; gnuplot's markup characters are dropped with the rest that
 * is not plain. */
void gnuplot_write_text(FILE *file, const char *name, const char *text) {
    fprintf(file, "%s = \"", name);
    for (const char *c = text; *c != '\0'; c++) {
        const bool plain = *c >= ' ' && *c <= '~' && strchr("\"\\{}^_@&~`", *c) == NULL;
        fputc(plain ? *c : ' ', file);
    }
    fputs("\"\n", file);
}

/* Only what may be called between fork() and exec(). */
static void become_gnuplot(int program, int picture, int complaints) {
    if (dup2(program, STDIN_FILENO) >= 0 && dup2(picture, STDOUT_FILENO) >= 0 &&
        dup2(complaints, STDERR_FILENO) >= 0) {
        execlp("gnuplot", "gnuplot", "-", (char *)NULL);
    }
    _exit(127);
}

/* False: gnuplot did not end well, or the system could not start it. */
static bool run_gnuplot(FILE *program, FILE *picture, FILE *complaints) {
    int status = 0;
    const pid_t child = fork();
    if (child == 0) {
        become_gnuplot(fileno(program), fileno(picture), fileno(complaints));
    }
    if (child < 0) {
        return false;
    }
    while (waitpid(child, &status, 0) < 0) {
        if (errno != EINTR) {
            return false;
        }
    }
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

/* The first line that says something. */
static void report_complaint(FILE *complaints) {
    char line[200];
    rewind(complaints);
    while (fgets(line, sizeof line, complaints) != NULL) {
        const size_t length = strcspn(line, "\n");
        if (length > strspn(line, " \t^")) {
            report_failure("gnuplot: %.*s", (int)length, line);
            return;
        }
    }
    report_failure("gnuplot failed");
}

bool gnuplot_draw(FILE *picture, gnuplot_writer *write, const void *user) {
    FILE *program = tmpfile();
    FILE *complaints = tmpfile();
    bool good = program != NULL && complaints != NULL;
    if (good) {
        write(program, user);
        good = fflush(program) == 0 && fseek(program, 0, SEEK_SET) == 0 && !ferror(program);
    }
    if (!good) {
        report_failure("no temporary file for the plot: %s", strerror(errno));
    } else if (!run_gnuplot(program, picture, complaints)) {
        report_complaint(complaints);
        good = false;
    }
    if (program != NULL) {
        fclose(program);
    }
    if (complaints != NULL) {
        fclose(complaints);
    }
    return good;
}
