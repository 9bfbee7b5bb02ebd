/* SPDX-License-Identifier: BSD-3-Clause */
/* Errors stand beside the size of what they are errors of: a newton means nothing by itself. */
#include "body_learned.h"

#include <inttypes.h>
#include <stddef.h>

static void print_source(FILE *file, const shcd_learned *l) {
    if (l->record.source == SHCD_LEARNED_SAMPLES) {
        fprintf(file, "%-22sa table of samples", "  trained on");
        if (l->record.consistency_rms_n > 0.0) {
            fprintf(file, "; its forces are %.3g N rms off the slope of its energies",
                    l->record.consistency_rms_n);
        }
        if (l->damping_n_s_per_m2 > 0.0) {
            fprintf(file, "; damping %.4g N s/m^2", l->damping_n_s_per_m2);
        }
        fputc('\n', file);
        return;
    }
    fprintf(file,
            "%-22sa membrane: E %.6g Pa, nu %.4g, patch %.4g mm, support %.4g mm, thickness %.4g "
            "mm, beta %.4g\n",
            "  trained on", l->young_pa, l->poisson_ratio, 1e3 * l->patch_radius_m,
            1e3 * l->support_length_m, 1e3 * l->thickness_m, l->stiffening);
}

void body_print_learned(FILE *file, const shcd_learned *l) {
    if (l == NULL) {
        fprintf(file, "%-22snone\n", "learned response");
        return;
    }
    const shcd_learned_record *r = &l->record;
    fprintf(file, "%-22s%zu centres, %zu %s in the depth, to %.4g mm; dents of %zu modes\n",
            "learned response", l->n_centres, l->n_terms, l->n_terms == 1 ? "term" : "terms",
            1e3 * l->depth_max_m, l->n_modes);
    print_source(file, l);
    fprintf(file, "%-22s%.4g to %.4g N/m, outside %.4g N/m\n", "  stiffness",
            r->stiffness_min_n_per_m, r->stiffness_max_n_per_m, l->direct_n_per_m);
    fprintf(file,
            "%-22smax %.3g, p99 %.3g, rms %.3g N of %.3g N rms (%" PRIu64
            " samples unseen, %" PRIu64 " seen)\n",
            "  force error", r->force_error_max_n, r->force_error_p99_n, r->force_error_rms_n,
            r->force_rms_n, r->n_holdout, r->n_samples);
    if (r->source == SHCD_LEARNED_MEMBRANE) {
        fprintf(file, "%-22smax %.3g, rms %.3g N along the surface\n", "  slope error",
                r->slope_error_max_n, r->slope_error_rms_n);
        fprintf(file, "%-22smax %.3g, p99 %.3g, rms %.3g m\n", "  dent error", r->dent_error_max_m,
                r->dent_error_p99_m, r->dent_error_rms_m);
    }
}

static void write_record(json_writer *json, const shcd_learned_record *r) {
    const struct {
        const char *name;
        double value;
    } number[] = {{"force_error_max_n", r->force_error_max_n},
                  {"force_error_p99_n", r->force_error_p99_n},
                  {"force_error_rms_n", r->force_error_rms_n},
                  {"force_rms_n", r->force_rms_n},
                  {"slope_error_max_n", r->slope_error_max_n},
                  {"slope_error_rms_n", r->slope_error_rms_n},
                  {"dent_error_max_m", r->dent_error_max_m},
                  {"dent_error_p99_m", r->dent_error_p99_m},
                  {"dent_error_rms_m", r->dent_error_rms_m},
                  {"consistency_rms_n", r->consistency_rms_n},
                  {"ridge", r->ridge},
                  {"quadrature_error", r->quadrature_error},
                  {"stiffness_min_n_per_m", r->stiffness_min_n_per_m},
                  {"stiffness_max_n_per_m", r->stiffness_max_n_per_m}};
    json_string(json, "source", r->source == SHCD_LEARNED_SAMPLES ? "samples" : "membrane");
    json_count(json, "n_samples", r->n_samples);
    json_count(json, "n_holdout", r->n_holdout);
    for (size_t i = 0; i < sizeof number / sizeof number[0]; i++) {
        json_number(json, number[i].name, number[i].value);
    }
}

void body_write_learned(json_writer *json, const shcd_learned *l) {
    if (l == NULL) {
        json_null(json, "learned");
        return;
    }
    json_open_object(json, "learned");
    json_count(json, "n_centres", l->n_centres);
    json_count(json, "n_terms", l->n_terms);
    json_count(json, "n_modes", l->n_modes);
    json_number(json, "support_m", l->support_m);
    json_number(json, "fill_m", l->fill_m);
    json_number(json, "depth_max_m", l->depth_max_m);
    json_number(json, "direct_n_per_m", l->direct_n_per_m);
    json_number(json, "damping_n_s_per_m2", l->damping_n_s_per_m2);
    json_number(json, "young_pa", l->young_pa);
    json_number(json, "poisson_ratio", l->poisson_ratio);
    json_number(json, "patch_radius_m", l->patch_radius_m);
    json_number(json, "support_length_m", l->support_length_m);
    json_number(json, "thickness_m", l->thickness_m);
    json_number(json, "foundation_n_per_m3", l->foundation_n_per_m3);
    json_number(json, "stiffening", l->stiffening);
    write_record(json, &l->record);
    json_close_object(json);
}
