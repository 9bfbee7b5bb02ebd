/* SPDX-License-Identifier: BSD-3-Clause */
/* Linux tells in /proc; elsewhere the architecture has to do. */
#include "cost_machine.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <sys/utsname.h>
#include <unistd.h>

/* The text behind the colon of the first line that starts with `key`. */
static void find_line(const char *path, const char *key, char *text, size_t size) {
    FILE *file = fopen(path, "r");
    char line[512];
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        const char *colon = strchr(line, ':');
        if (strncmp(line, key, strlen(key)) == 0 && colon != NULL) {
            colon += 1 + strspn(colon + 1, " \t");
            snprintf(text, size, "%.*s", (int)strcspn(colon, "\n"), colon);
            break;
        }
    }
    if (file != NULL) {
        fclose(file);
    }
}

static double read_load(void) {
    FILE *file = fopen("/proc/loadavg", "r");
    double load = -1.0;
    if (file != NULL) {
        if (fscanf(file, "%lf", &load) != 1) {
            load = -1.0;
        }
        fclose(file);
    }
    return load;
}

void cost_machine_describe(cost_machine *machine) {
    struct utsname names;
    memset(machine, 0, sizeof *machine);
    snprintf(machine->architecture, sizeof machine->architecture, "unknown");
    snprintf(machine->system, sizeof machine->system, "unknown");
    if (uname(&names) >= 0) {
        snprintf(machine->architecture, sizeof machine->architecture, "%.60s", names.machine);
        snprintf(machine->system, sizeof machine->system, "%.60s %.60s", names.sysname,
                 names.release);
    }
    snprintf(machine->cpu, sizeof machine->cpu, "%s", machine->architecture);
    find_line("/proc/cpuinfo", "model name", machine->cpu, sizeof machine->cpu);
    machine->n_processors = (int)sysconf(_SC_NPROCESSORS_ONLN);
    machine->load = read_load();
}
