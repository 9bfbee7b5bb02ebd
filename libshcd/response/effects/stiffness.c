/* SPDX-License-Identifier: BSD-3-Clause */
/* stiffness: the elastic force along the normal, by one of three laws.
 *
 * Linear, F = k depth. The default suits an impedance-type desktop device, whose stable range
 * starts at a few hundred N/m, and lies above the tangent stiffness of soft organs under a small
 * tool (order 100 N/m).
 *
 * Hertz: a rigid ball of radius R on a half-space, E* = E/(1 - nu^2), in the contact radius
 * a = sqrt(R depth):
 *     depth = a^2/R,  F = 4 E* a^3/(3 R) = (4/3) E* sqrt(R) depth^(3/2),  dF/ddepth = 2 E* a.
 * The body counts as flat at the size of the tool: R is the tool's radius alone.
 *
 * Hertz on a body with `wave`. The membrane already gives way by 1/(2 E* p) under its patch of
 * radius p, as a half-space does under a flat punch; only what a smaller contact gives way beyond
 * that is local, 1/k = 1/(2 E* a) - s/(2 E* p), s the share of the wave that acts. Integrated over
 * dF = 4 E* a^2/R da, up to a = p/s, from where on the contact is rigid:
 *     depth = a^2/R - 2 s a^3/(3 R p),  F = 4 E* a^3/(3 R),
 *     energy = 8 E* (a^5/5 - s a^6/(6 p))/(3 R^2).
 * Without the wave s = 0, and this is Hertz again.
 *
 * Tabulated: nominal stress over strain, strain = depth/thickness, straight between the rows and
 * from the last two on, F = stress pi c^2. Straight, so that the force under a compliance has a
 * closed form. */
#include "base/internal.h"
#include "response/effects.h"

#define PI 3.14159265358979324
/* From 1e14 times the root Newton on a cubic takes 80 steps, each two thirds of the way down. */
#define NEWTON_MAX 128
/* A wave that acts less than this is none: sizes stay far from overflow. */
#define WAVE_SHARE_MIN 1e-9
#define ROWS_MAX 16

enum { K, YOUNG, POISSON, TOOL_RADIUS, STRESS_STRAIN, THICKNESS, CONTACT_RADIUS, N_PARAMETERS };

static const shcd_column_info stress_strain_columns[] = {
    {"strain", "1", 0.0, 100.0},
    {"stress_pa", "Pa", 0.0, 1e9},
};

static const shcd_parameter_info parameters[] = {
    [K] = {"k_n_per_m", "N/m", 300.0, 0.0, 1e5, "linear law: force per metre of penetration"},
    [YOUNG] = {"youngs_modulus_pa", "Pa", 0.0, 0.0, 1e12,
               "Hertz law, instead of k_n_per_m; 0: another law"},
    [POISSON] = {"poisson_ratio", "1", 0.45, 0.0, 0.5, "Hertz law: of the body"},
    [TOOL_RADIUS] = {"tool_radius_m", "m", 0.0, 0.0, 1.0,
                     "Hertz law: R; 0: that of the tool, 1 mm where the tool is sharp"},
    [STRESS_STRAIN] = {"stress_strain", "1", 0.0, 0.0, 0.0,
                       "tabulated law, instead of k_n_per_m: nominal stress over depth/thickness",
                       stress_strain_columns, 2, 1, ROWS_MAX},
    [THICKNESS] = {"thickness_m", "m", 0.01, 1e-5, 10.0,
                   "tabulated law: depth at strain 1, the thickness of the layer"},
    [CONTACT_RADIUS] = {"contact_radius_m", "m", 0.0, 0.0, 1.0,
                        "tabulated law: the stress acts on pi times its square; 0: that of the "
                        "tool, 1 mm where the tool is sharp"},
};

/* ---- constants ------------------------------------------------------------------------------- */

enum { LAW_LINEAR, LAW_HERTZ, LAW_TABLE };

/* What they mean depends on the first. Hertz: E*; R or 0; p or 0. Table: c or 0; number of knots
 * behind the origin; the knots. */
enum { C_LAW };
enum { C_STIFFNESS = 1 };
enum { C_MODULUS = 1, C_RADIUS, C_PATCH };
enum { C_AREA_RADIUS = 1, C_COUNT, C_KNOTS };

/* A knot of the table; its slope holds up to the next one. */
enum { KNOT_DEPTH, KNOT_PRESSURE, KNOT_SLOPE, N_KNOT };

_Static_assert(C_KNOTS + (ROWS_MAX + 1) * N_KNOT <= SHCDI_EFFECT_CONSTANTS_MAX,
               "the constants hold the longest table");

static void prepare(const double *values, double *constants) {
    if (values[YOUNG] > 0.0) {
        constants[C_LAW] = LAW_HERTZ;
        constants[C_MODULUS] = values[YOUNG] / (1.0 - values[POISSON] * values[POISSON]);
        constants[C_RADIUS] = values[TOOL_RADIUS];
        constants[C_PATCH] = 0.0;
    } else {
        constants[C_LAW] = LAW_LINEAR;
        constants[C_STIFFNESS] = values[K];
    }
}

static void couple(double *constants, double patch_radius_m) {
    if (constants[C_LAW] == LAW_HERTZ) {
        constants[C_PATCH] = patch_radius_m;
    }
}

static shcd_status check_laws(const char *body, const shcdi_settings *s, shcd_error *error) {
    static const int owner[N_PARAMETERS] = {
        K, YOUNG, YOUNG, YOUNG, STRESS_STRAIN, STRESS_STRAIN, STRESS_STRAIN};
    const bool is_chosen[N_PARAMETERS] = {[K] = s->is_given[K],
                                          [YOUNG] = s->value[YOUNG] > 0.0,
                                          [STRESS_STRAIN] = s->is_given[STRESS_STRAIN]};
    int chosen = -1;
    for (int i = 0; i < N_PARAMETERS; i++) {
        if (is_chosen[i] && chosen >= 0) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                              "scene_create: body '%s': effect 'stiffness': '%s' and '%s' are two "
                              "laws; give one of them",
                              body, parameters[chosen].name, parameters[i].name);
        }
        chosen = is_chosen[i] ? i : chosen;
    }
    chosen = chosen < 0 ? K : chosen;
    for (int i = 0; i < N_PARAMETERS; i++) {
        /* a zero names no other law, and says what is so anyway */
        if (s->is_given[i] && owner[i] != chosen && (i != YOUNG || s->value[i] > 0.0)) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                              "scene_create: body '%s': effect 'stiffness': '%s' belongs to the "
                              "law of '%s', which is not given",
                              body, parameters[i].name, parameters[owner[i]].name);
        }
    }
    return SHCD_OK;
}

shcd_status shcdi_settle_stiffness(const char *body, const shcdi_settings *s, double *constants,
                                   shcd_error *error) {
    const double *row = s->table[STRESS_STRAIN];
    const shcd_status status = check_laws(body, s, error);
    size_t n = 0;
    double *knot = constants + C_KNOTS;
    if (status != SHCD_OK || row == NULL) {
        return status;
    }
    constants[C_LAW] = LAW_TABLE;
    constants[C_AREA_RADIUS] = s->value[CONTACT_RADIUS];
    knot[KNOT_DEPTH] = knot[KNOT_PRESSURE] = knot[KNOT_SLOPE] = 0.0;
    for (size_t i = 0; i < s->n_rows[STRESS_STRAIN]; i++, row += 2) {
        const double depth = row[0] * s->value[THICKNESS];
        const double rise = row[1] - knot[KNOT_PRESSURE];
        if (row[1] < knot[KNOT_PRESSURE] || (row[0] == 0.0 && row[1] > 0.0)) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                              "scene_create: body '%s': effect 'stiffness': parameter "
                              "'stress_strain': row %zu: the stress must %s",
                              body, i, row[0] == 0.0 ? "be 0 at strain 0" : "not fall");
        }
        if (row[0] == 0.0) {
            continue; /* the origin is there anyway */
        }
        knot[KNOT_SLOPE] = rise / (depth - knot[KNOT_DEPTH]);
        knot[N_KNOT + KNOT_DEPTH] = depth;
        knot[N_KNOT + KNOT_PRESSURE] = row[1];
        knot[N_KNOT + KNOT_SLOPE] = knot[KNOT_SLOPE];
        knot += N_KNOT;
        n++;
        if (!shcdi_is_finite(knot[KNOT_SLOPE])) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                              "scene_create: body '%s': effect 'stiffness': parameter "
                              "'stress_strain': row %zu: the strain is too close to the last one",
                              body, i);
        }
    }
    constants[C_COUNT] = (double)n;
    return SHCD_OK;
}

/* ---- the laws under a compliance W: indentation(F) + W F = depth ------------------------------
 */

static double radius_or(double given_m, const shcdi_touch *touch) {
    const double own = touch->tool_radius_m > 0.0 ? touch->tool_radius_m : SHCDI_SHARP_RADIUS_M;
    return given_m > 0.0 ? given_m : own;
}

/* With W = 0 the product k depth, to the bit. */
static double press_linear(double k, double depth_m, double w, double *stored_j) {
    const double indentation_m = depth_m / (1.0 + k * w);
    *stored_j = 0.5 * k * indentation_m * indentation_m;
    return k * indentation_m;
}

/* The root of f(a) = c3 a^3 + c2 a^2 - depth in [0, high], f(high) >= 0, where f rises and its
 * slope does too or turns once (c3 < 0): Newton, or half of the bracket where Newton leaves it. */
static double contact_radius(double c3, double c2, double depth_m, double high) {
    double low = 0.0, a = high;
    for (int n = 0; n < NEWTON_MAX && low < high; n++) {
        const double f = (c3 * a + c2) * a * a - depth_m;
        const double slope = (3.0 * c3 * a + 2.0 * c2) * a;
        if (f > 0.0) {
            high = a;
        } else {
            low = a;
        }
        double next = slope > 0.0 ? a - f / slope : low;
        next = next > low && next < high ? next : 0.5 * (low + high);
        if (fabs(next - a) <= 0x1p-52 * a) {
            return next;
        }
        a = next;
    }
    return a;
}

static double press_hertz(const double *c, const shcdi_touch *touch, double depth_m, double w,
                          double *stored_j) {
    const double radius = radius_or(c[C_RADIUS], touch), e = c[C_MODULUS];
    /* a contact that the wave does not take part in is one with a half-space */
    const bool is_tied = c[C_PATCH] > 0.0 && w > 0.0 && touch->wave_share > WAVE_SHARE_MIN;
    const double tie = is_tied ? touch->wave_share / c[C_PATCH] : 0.0;
    const double scale = 4.0 * e / (3.0 * radius); /* F = scale a^3 */
    const double c3 = w * scale - 2.0 * tie / (3.0 * radius);
    double a = sqrt(radius * depth_m);
    if (tie > 0.0) {
        const double edge = 1.0 / tie;
        const double local_m = edge * edge / (3.0 * radius);
        const double force_n = scale * edge * edge * edge;
        if (depth_m - local_m >= w * force_n) {
            *stored_j = 8.0 * e / (90.0 * radius * radius) * edge * edge * edge * edge * edge;
            return (depth_m - local_m) / w;
        }
        /* c3 >= -2 tie/(3 R): at sqrt(3 R depth) <= edge the left side is at least the depth */
        a = contact_radius(c3, 1.0 / radius, depth_m,
                           shcdi_min(edge, sqrt(3.0 * radius * depth_m)));
    } else if (w > 0.0) {
        a = contact_radius(c3, 1.0 / radius, depth_m, a);
    }
    *stored_j = 8.0 * e / (3.0 * radius * radius) * (0.2 - tie * a / 6.0) * a * a * a * a * a;
    return scale * a * a * a;
}

static double press_table(const double *c, const shcdi_touch *touch, double depth_m, double w,
                          double *stored_j) {
    const double radius = radius_or(c[C_AREA_RADIUS], touch);
    const double area = PI * radius * radius;
    const double *knot = c + C_KNOTS;
    const double *last = knot + N_KNOT * (size_t)c[C_COUNT];
    double energy = 0.0;
    /* depth + W F rises from knot to knot: the last one that is not beyond the depth */
    while (knot < last &&
           knot[N_KNOT + KNOT_DEPTH] + area * w * knot[N_KNOT + KNOT_PRESSURE] <= depth_m) {
        energy += 0.5 * (knot[KNOT_PRESSURE] + knot[N_KNOT + KNOT_PRESSURE]) *
                  (knot[N_KNOT + KNOT_DEPTH] - knot[KNOT_DEPTH]);
        knot += N_KNOT;
    }
    const double beyond_m = (depth_m - knot[KNOT_DEPTH] - area * w * knot[KNOT_PRESSURE]) /
                            (1.0 + area * w * knot[KNOT_SLOPE]);
    const double pressure = knot[KNOT_PRESSURE] + knot[KNOT_SLOPE] * beyond_m;
    *stored_j = area * (energy + 0.5 * (knot[KNOT_PRESSURE] + pressure) * beyond_m);
    return area * pressure;
}

static double press(const double *constants, const shcdi_touch *touch, double depth_m,
                    double compliance_m_per_n, double *stored_j) {
    if (!(depth_m > 0.0)) {
        *stored_j = 0.0;
        return 0.0;
    }
    if (constants[C_LAW] == LAW_HERTZ) {
        return press_hertz(constants, touch, depth_m, compliance_m_per_n, stored_j);
    }
    if (constants[C_LAW] == LAW_TABLE) {
        return press_table(constants, touch, depth_m, compliance_m_per_n, stored_j);
    }
    return press_linear(constants[C_STIFFNESS], depth_m, compliance_m_per_n, stored_j);
}

const shcdi_effect shcdi_effect_stiffness = {
    {"stiffness",
     "elastic force along the normal; linear: F = k depth; Hertz: F = 4/3 E/(1 - nu^2) sqrt(R) "
     "depth^(3/2), less what wave gives way; tabulated: F = stress(depth/thickness) pi c^2",
     "R. Hooke (1678); H. Hertz, J. reine angew. Math. 92, 156-171 (1881); K. L. Johnson, Contact "
     "Mechanics, Cambridge (1985), 3.8 and 4.2",
     N_PARAMETERS, parameters},
    0,
    prepare,
    NULL,
    press,
    NULL,
    couple,
};
