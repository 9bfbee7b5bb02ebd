/* SPDX-License-Identifier: BSD-3-Clause */
/* The child imports, checks and repairs, then writes one answer into a pipe: status, message,
 * report, and the clean arrays. The parent reads it against the clock and makes its own mesh from
 * the arrays, so that nothing is believed but the text of a message and the counts of repairs.
 *
 * The limits. Measured: meshes take 3 to 11 times the size of their file in memory and 0.02 to 0.04
 * s of processor time per MB; the worst files that the scanners let through (faces of up to 1000
 * corners) take 58 times and 1.8 s per MB. The factors lie above both, so that a limit is met only
 * by what nobody has seen yet. */
#include "import_child.h"

#include "report.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define MIB 1048576.0

enum {
    MEMORY_BASE_MIB = 256,
    MEMORY_PER_BYTE = 64,
    TIME_BASE_S = 10,
    TIME_PER_MIB_S = 4,
    CLOCK_PER_TIME = 4, /* a loaded machine, a slow disk */
    SIZE_UNKNOWN_MIB = 16
};

/* Precedes the arrays: 3 doubles a vertex, 3 indices a triangle. */
typedef struct answer {
    shcd_status status;
    shcd_error error;
    shcd_mesh_report report;
    uint64_t n_vertices, n_triangles;
} answer;

typedef struct importer {
    const char *path;
    double unit_m;
    int memory_mib, time_s; /* in force */
    pid_t pid;
    int pipe; /* the parent's end */
    double deadline_s;
} importer;

static double now_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int at_most(double value, int cap) {
    return value < (double)cap ? (int)value : cap;
}

static void choose_limits(const import_limits *limits, importer *i) {
    struct stat status;
    double size_mib = SIZE_UNKNOWN_MIB;
    const double machine_mib =
        (double)sysconf(_SC_PHYS_PAGES) * (double)sysconf(_SC_PAGESIZE) / MIB;
    if (stat(i->path, &status) == 0 && S_ISREG(status.st_mode)) {
        size_mib = (double)status.st_size / MIB;
    }
    i->memory_mib = limits->memory_mib;
    if (i->memory_mib == 0) {
        i->memory_mib = at_most(MEMORY_BASE_MIB + MEMORY_PER_BYTE * size_mib,
                                at_most(machine_mib, IMPORT_MEMORY_MAX_MIB));
    }
    i->time_s = limits->time_s;
    if (i->time_s == 0) {
        i->time_s = at_most(TIME_BASE_S + TIME_PER_MIB_S * size_mib, IMPORT_TIME_MAX_S);
    }
    i->deadline_s = now_s() + (double)CLOCK_PER_TIME * (double)i->time_s;
}

/* ---- the child ---- */

/* Never above what the process has been given from outside. */
static bool lower_limit(int resource, rlim_t soft, rlim_t hard) {
    struct rlimit limit;
    if (getrlimit(resource, &limit) != 0) {
        return false;
    }
    limit.rlim_max = limit.rlim_max < hard ? limit.rlim_max : hard;
    limit.rlim_cur = limit.rlim_max < soft ? limit.rlim_max : soft;
    return setrlimit(resource, &limit) == 0;
}

/* Address space in use already: libraries, and what a sanitizer reserves. */
static rlim_t used_bytes(void) {
    unsigned long long pages = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (file == NULL || fscanf(file, "%llu", &pages) != 1) {
        pages = 0;
    }
    if (file != NULL) {
        fclose(file);
    }
    return (rlim_t)pages * (rlim_t)sysconf(_SC_PAGESIZE);
}

/* The child dies with its parent, writes no core file, and has nothing to say but its answer. */
static bool confine(const importer *i, pid_t parent) {
    const rlim_t memory = used_bytes() + (rlim_t)i->memory_mib * (rlim_t)MIB;
    const int nowhere = open("/dev/null", O_WRONLY);
    return prctl(PR_SET_PDEATHSIG, SIGKILL) == 0 && getppid() == parent &&
           prctl(PR_SET_DUMPABLE, 0) == 0 && nowhere >= 0 && dup2(nowhere, STDOUT_FILENO) >= 0 &&
           dup2(nowhere, STDERR_FILENO) >= 0 && lower_limit(RLIMIT_CORE, 0, 0) &&
           lower_limit(RLIMIT_CPU, (rlim_t)i->time_s, (rlim_t)i->time_s + 1) &&
           lower_limit(RLIMIT_AS, memory, memory);
}

static bool write_all(int descriptor, const void *bytes, size_t size) {
    const char *at = bytes;
    while (size > 0) {
        const ssize_t n = write(descriptor, at, size);
        if (n < 0 && errno != EINTR) {
            return false;
        }
        if (n > 0) {
            at += n;
            size -= (size_t)n;
        }
    }
    return true;
}

static bool work(const importer *i, int to) {
    answer a;
    shcd_mesh *mesh = NULL;
    memset(&a, 0, sizeof a);
    a.report.struct_size = sizeof a.report;
    a.status = shcd_mesh_import(i->path, i->unit_m, &mesh, &a.report, &a.error);
    a.n_vertices = shcd_mesh_vertex_count(mesh);
    a.n_triangles = shcd_mesh_triangle_count(mesh);
    return write_all(to, &a, sizeof a) &&
           write_all(to, shcd_mesh_vertices(mesh), 3 * a.n_vertices * sizeof(double)) &&
           write_all(to, shcd_mesh_triangles(mesh), 3 * a.n_triangles * sizeof(uint32_t));
}

/* ---- the parent ---- */

/* False: reported. */
static bool start(importer *i) {
    int ends[2];
    const pid_t parent = getpid();
    if (pipe(ends) != 0) {
        report_failure("%s: cannot start the import: %s", i->path, strerror(errno));
        return false;
    }
    signal(SIGCHLD, SIG_DFL); /* if it is ignored, the child's end cannot be waited for */
    i->pid = fork();
    if (i->pid < 0) {
        report_failure("%s: cannot start the import: %s", i->path, strerror(errno));
        close(ends[0]);
        close(ends[1]);
        return false;
    }
    if (i->pid == 0) {
        close(ends[0]);
        /* _exit: what the parent has in its buffers is the parent's to write */
        _exit(confine(i, parent) && work(i, ends[1]) ? STATUS_DONE : STATUS_FAILED);
    }
    close(ends[1]);
    i->pipe = ends[0];
    return true;
}

static bool is_late(const importer *i) {
    return now_s() > i->deadline_s;
}

/* False: the child has ended or is late. */
static bool receive(const importer *i, void *bytes, size_t size) {
    char *at = bytes;
    while (size > 0) {
        struct pollfd wait = {i->pipe, POLLIN, 0};
        const double left_ms = 1e3 * (i->deadline_s - now_s());
        const int ready = left_ms > 0.0 ? poll(&wait, 1, at_most(left_ms + 1.0, 1000000)) : 0;
        if (ready > 0) {
            const ssize_t n = read(i->pipe, at, size);
            if (n == 0 || (n < 0 && errno != EINTR)) {
                return false;
            }
            at += n > 0 ? n : 0;
            size -= n > 0 ? (size_t)n : 0;
        } else if ((ready < 0 && errno != EINTR) || is_late(i)) {
            return false;
        }
    }
    return true;
}

/* What ended the child; it is given no longer than the deadline. */
static int finish(const importer *i) {
    const struct timespec pause = {0, 1000000};
    int status = 0;
    close(i->pipe);
    for (;;) {
        const pid_t ended = waitpid(i->pid, &status, WNOHANG);
        if (ended != 0 && !(ended < 0 && errno == EINTR)) {
            return status;
        }
        if (is_late(i)) {
            kill(i->pid, SIGKILL);
        }
        nanosleep(&pause, NULL);
    }
}

static void report_death(const importer *i, int status, bool late) {
    char limits[96];
    snprintf(limits, sizeof limits, "it may take %d s and %d MiB (--import-time, --import-memory)",
             i->time_s, i->memory_mib);
    if (late) {
        report_failure("%s: the import was given up after %d s; %s", i->path,
                       CLOCK_PER_TIME * i->time_s, limits);
    } else if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) {
        report_failure("%s: the import takes too long; %s", i->path, limits);
    } else if (WIFSIGNALED(status)) {
        report_failure("%s: the import died of signal %d (%s); %s", i->path, WTERMSIG(status),
                       strsignal(WTERMSIG(status)), limits);
    } else {
        report_failure("%s: the import ended with status %d and no answer; %s", i->path,
                       WIFEXITED(status) ? WEXITSTATUS(status) : -1, limits);
    }
}

static void report_refusal(const importer *i, answer *a) {
    a->error.message[sizeof a->error.message - 1] = '\0';
    if (a->status == SHCD_ERR_MEMORY) {
        report_failure("%s: out of memory; the import may take %d MiB (--import-memory)", i->path,
                       i->memory_mib);
    } else {
        report_failure("%s", report_reason(a->status, &a->error));
    }
}

/* Counts of repairs from the child, everything else from the arrays themselves. */
static shcd_mesh *make_mesh(const importer *i, const answer *a, const double *vertices,
                            const uint32_t *triangles, shcd_mesh_report *report) {
    shcd_mesh *mesh = NULL;
    shcd_error error = {SHCD_OK, ""};
    shcd_mesh_report measured = SHCD_MESH_REPORT_INIT;
    const shcd_status status = shcd_mesh_create(vertices, (size_t)a->n_vertices, triangles,
                                                (size_t)a->n_triangles, &mesh, &measured, &error);
    if (status != SHCD_OK) {
        report_failure("%s: %s", i->path, report_reason(status, &error));
        return NULL;
    }
    *report = a->report;
    report->n_vertices = measured.n_vertices;
    report->n_triangles = measured.n_triangles;
    report->diagonal_m = measured.diagonal_m;
    report->volume_m3 = measured.volume_m3;
    report->area_m2 = measured.area_m2;
    return mesh;
}

/* Reads the arrays. *mesh is NULL if that was reported; false: the child said less than announced.
 */
static bool receive_mesh(const importer *i, const answer *a, shcd_mesh_report *report,
                         shcd_mesh **mesh) {
    const double most = (double)i->memory_mib * MIB;
    double *vertices = NULL;
    uint32_t *triangles = NULL;
    bool complete = false;
    if ((double)a->n_vertices > most || (double)a->n_triangles > most || a->n_vertices == 0 ||
        a->n_triangles == 0) {
        return false; /* the child could not have held it */
    }
    vertices = malloc((size_t)a->n_vertices * 3 * sizeof *vertices);
    triangles = malloc((size_t)a->n_triangles * 3 * sizeof *triangles);
    if (vertices == NULL || triangles == NULL) {
        report_failure("%s: out of memory", i->path);
        complete = true;
    } else {
        complete = receive(i, vertices, (size_t)a->n_vertices * 3 * sizeof *vertices) &&
                   receive(i, triangles, (size_t)a->n_triangles * 3 * sizeof *triangles);
        *mesh = complete ? make_mesh(i, a, vertices, triangles, report) : NULL;
    }
    free(vertices);
    free(triangles);
    return complete;
}

shcd_mesh *import_in_child(const char *path, double unit_m, const import_limits *limits,
                           shcd_mesh_report *report) {
    importer i = {.path = path, .unit_m = unit_m};
    answer a;
    shcd_mesh *mesh = NULL;
    bool complete;
    int status;
    choose_limits(limits, &i);
    if (!start(&i)) {
        return NULL;
    }
    complete = receive(&i, &a, sizeof a);
    if (complete && a.status != SHCD_OK) {
        report_refusal(&i, &a);
    } else if (complete) {
        complete = receive_mesh(&i, &a, report, &mesh);
    }
    if (complete) {
        kill(i.pid, SIGKILL); /* it has nothing more to do */
    }
    status = finish(&i);
    if (!complete) {
        report_death(&i, status, is_late(&i));
    }
    return mesh;
}
