/* SPDX-License-Identifier: BSD-3-Clause */
/* Left what the network says against the truth, right by how much it errs over the depth. */
#include "train_plot.h"

#include "report.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* In front of it: is_png, the texts, the errors' max, p99 and rms [mN], and the blocks of data. */
static const char script[] =
    "set encoding utf8\n"
    "if (is_png) {\n"
    "    set terminal pngcairo size 1650, 780 enhanced font 'DejaVu Sans,17' background '#ffffff'\n"
    "    small = ',13'\n"
    "    large = ',20'\n"
    "} else {\n"
    "    set terminal svg size 1100, 520 dynamic enhanced font 'DejaVu Sans,13' background "
    "'#ffffff'\n"
    "    small = ',10'\n"
    "    large = ',16'\n"
    "}\n"
    "blue = '#1f5fa8'\n"
    "grey = '#6f6f6f'\n"
    "dark = '#303030'\n"
    "pale = '#e4e4e4'\n"
    "set multiplot layout 1, 2\n"
    "set label 1 sprintf('The learned response of %s, on samples it has not seen', body) at "
    "screen 0.02, 0.955 font large textcolor rgb dark\n"
    "set label 2 about at screen 0.02, 0.9 font small textcolor rgb grey\n"
    "set border 3 lc rgb dark\n"
    "set tics nomirror textcolor rgb dark\n"
    "set grid ytics lt 1 lw 0.7 lc rgb pale\n"
    "set tmargin 6\n"
    "set bmargin 4\n"
    "set lmargin 11\n"
    "set rmargin 4\n"
    "unset key\n"
    "set xlabel 'force of the samples [N]' textcolor rgb dark\n"
    "set ylabel 'force of the network [N]' textcolor rgb dark\n"
    "plot x with lines lt 1 lw 1 lc rgb grey, \\\n"
    "    $checks using 2:3 with points pt 7 ps 0.5 lc rgb blue\n"
    "unset label 1\n"
    "unset label 2\n"
    "set xlabel 'depth [mm]' textcolor rgb dark\n"
    "set ylabel 'error of the force [mN]' textcolor rgb dark\n"
    "set label 3 sprintf(' p99 %.3g mN', p99) at graph 1, first p99 right offset 0, 0.6 font small "
    "textcolor rgb dark\n"
    "set label 4 sprintf(' rms %.3g mN', rms) at graph 1, first rms right offset 0, 0.6 font small "
    "textcolor rgb dark\n"
    "set yrange [0 : 1.15 * max]\n"
    "plot $checks using 1:4 with points pt 7 ps 0.5 lc rgb blue, \\\n"
    "    p99 with lines lt 1 lw 1 dt 2 lc rgb dark, rms with lines lt 1 lw 1 dt 3 lc rgb dark\n"
    "unset multiplot\n";

typedef struct train_plot {
    enum gnuplot_format format;
    const char *body;
    const shcd_learned *learned;
    const train_checks *checks;
} train_plot;

void train_checks_add(const shcd_train_check *check, void *user) {
    train_checks *checks = user;
    if (checks->n == checks->room) {
        const size_t room = checks->room > 0 ? 2 * checks->room : 256;
        shcd_train_check *grown = realloc(checks->check, room * sizeof *grown);
        if (grown == NULL) {
            checks->failed = true;
            return;
        }
        checks->check = grown;
        checks->room = room;
    }
    checks->check[checks->n++] = *check;
}

static void write_program(FILE *file, const void *user) {
    const train_plot *plot = user;
    const shcd_learned *l = plot->learned;
    const char *slash = strrchr(plot->body, '/');
    char about[200];
    snprintf(about, sizeof about, "%zu centres, %zu %s in the depth; largest error %.3g mN",
             l->n_centres, l->n_terms, l->n_terms == 1 ? "term" : "terms",
             1e3 * l->record.force_error_max_n);
    fprintf(file, "is_png = %d\n", plot->format == GNUPLOT_PNG ? 1 : 0);
    gnuplot_write_text(file, "body", slash != NULL ? slash + 1 : plot->body);
    gnuplot_write_text(file, "about", about);
    fprintf(file, "max = %.6g\np99 = %.6g\nrms = %.6g\n$checks << EOD\n",
            fmax(1e-9, 1e3 * l->record.force_error_max_n), 1e3 * l->record.force_error_p99_n,
            1e3 * l->record.force_error_rms_n);
    for (size_t i = 0; i < plot->checks->n; i++) {
        const shcd_train_check *c = &plot->checks->check[i];
        fprintf(file, "%.6g %.6g %.6g %.6g\n", 1e3 * c->depth_m, c->force_n, c->network_force_n,
                1e3 * fabs(c->network_force_n - c->force_n));
    }
    fprintf(file, "EOD\n%s", script);
}

bool train_plot_draw(FILE *picture, enum gnuplot_format format, const char *body,
                     const shcd_learned *learned, const train_checks *checks) {
    const train_plot plot = {format, body, learned, checks};
    if (checks->failed) {
        report_failure("no memory");
        return false;
    }
    return gnuplot_draw(picture, write_program, &plot);
}
