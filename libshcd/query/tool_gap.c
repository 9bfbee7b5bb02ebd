/* SPDX-License-Identifier: BSD-3-Clause */
/* Distance between the core of a tool and the hull of a few points: the iteration of Gilbert,
 * Johnson and Keerthi (A fast procedure for computing the distance between complex objects in
 * three-dimensional space, IEEE J. Robotics and Automation 4(2), 1988) on D = {x - y}, x of the
 * points' hull, y of K.
 *
 * v is the point of a simplex of D nearest to the origin, s the point of D farthest along -v. Then
 * v.s/|v| <= distance <= |v|: the interval is certified whatever the rounding of the simplex steps
 * did, and the best of both sides is kept. So a degenerate simplex can cost accuracy, which the
 * interval shows, but no truth; and the loop has a cap. */
#include "query/tool_core.h"

#define STEPS_MAX 32
#define FLAT 1e-12 /* height over length: three digits above what rounding makes of a volume */

typedef struct corner {
    shcd_vec3 d, y; /* x - y, y */
    int x, index;   /* which of the points, which vertex of the core */
} corner;

typedef struct simplex {
    int n;
    corner c[4];
    double weight[4];
} simplex;

static shcd_vec3 combine(const simplex *s) {
    shcd_vec3 v = shcd_scale(s->weight[0], s->c[0].d);
    for (int i = 1; i < s->n; i++) {
        v = shcd_mul_add(v, s->weight[i], s->c[i].d);
    }
    return v;
}

static void keep(simplex *s, int i, int k, double t) {
    const corner a = s->c[i], b = s->c[k];
    s->n = 2;
    s->c[0] = a;
    s->c[1] = b;
    s->weight[0] = 1.0 - t;
    s->weight[1] = t;
}

static void keep_one(simplex *s, int i) {
    s->c[0] = s->c[i];
    s->weight[0] = 1.0;
    s->n = 1;
}

/* Nearest of the corners i and k, and of the edge between them. */
static double edge(simplex *s, int i, int k) {
    const shcd_vec3 ab = shcd_sub(s->c[k].d, s->c[i].d);
    const double n = shcd_dot(ab, ab), along = -shcd_dot(s->c[i].d, ab);
    const double t = n > 0.0 ? along / n : 0.0;
    if (!(t > 0.0)) {
        keep_one(s, i);
    } else if (t >= 1.0) {
        keep_one(s, k);
    } else {
        keep(s, i, k, t);
    }
    const shcd_vec3 v = combine(s);
    return shcd_dot(v, v);
}

/* The triangle of three of the corners: inside by the signs of the areas, else the best edge. */
static double triangle(simplex *s, int i, int j, int k) {
    const shcd_vec3 a = s->c[i].d, b = s->c[j].d, c = s->c[k].d;
    const shcd_vec3 n = shcd_cross(shcd_sub(b, a), shcd_sub(c, a));
    const double area = shcd_dot(n, n);
    const double wa = shcd_dot(n, shcd_cross(b, c)), wb = shcd_dot(n, shcd_cross(c, a));
    const double wc = area - wa - wb;
    if (area > 0.0 && wa > 0.0 && wb > 0.0 && wc > 0.0) {
        const corner kept[3] = {s->c[i], s->c[j], s->c[k]};
        s->n = 3;
        for (int m = 0; m < 3; m++) {
            s->c[m] = kept[m];
        }
        s->weight[0] = wa / area;
        s->weight[1] = wb / area;
        s->weight[2] = 1.0 - s->weight[0] - s->weight[1];
        const shcd_vec3 v = combine(s);
        return shcd_dot(v, v);
    }
    simplex best = *s;
    double least = edge(&best, i, j);
    const int pair[2][2] = {{j, k}, {k, i}};
    for (int m = 0; m < 2; m++) {
        simplex other = *s;
        const double d = edge(&other, pair[m][0], pair[m][1]);
        if (d < least) {
            least = d;
            best = other;
        }
    }
    *s = best;
    return least;
}

/* 1 if the origin is inside the tetrahedron; else its nearest face. Of a tetrahedron that is flat
 * to rounding the signs of volumes tell nothing: it has faces only. */
static int tetrahedron(simplex *s) {
    static const int face[4][4] = {{0, 1, 2, 3}, {0, 3, 1, 2}, {0, 2, 3, 1}, {1, 3, 2, 0}};
    simplex best = *s;
    double least = HUGE_VAL;
    int inside = 1;
    for (int m = 0; m < 4; m++) {
        const int *f = face[m];
        const shcd_vec3 a = s->c[f[0]].d;
        const shcd_vec3 n = shcd_cross(shcd_sub(s->c[f[1]].d, a), shcd_sub(s->c[f[2]].d, a));
        const shcd_vec3 e = shcd_sub(s->c[f[3]].d, a);
        const double opposite = shcd_dot(n, e), origin = -shcd_dot(n, a);
        const int is_flat = opposite * opposite <= FLAT * FLAT * shcd_dot(n, n) * shcd_dot(e, e);
        if (!is_flat && opposite * origin > 0.0) {
            continue;
        }
        inside = 0;
        simplex other = *s;
        const double d = triangle(&other, f[0], f[1], f[2]);
        if (d < least) {
            least = d;
            best = other;
        }
    }
    if (!inside) {
        *s = best;
    }
    return inside;
}

static int reduce(simplex *s) {
    s->weight[0] = 1.0;
    if (s->n == 2) {
        edge(s, 0, 1);
    } else if (s->n == 3) {
        triangle(s, 0, 1, 2);
    } else if (s->n == 4) {
        return tetrahedron(s);
    }
    return 0;
}

static int hull_support(const shcd_tool_geometry *tool, shcd_vec3 direction) {
    int best = 0;
    double most = -HUGE_VAL;
    for (size_t i = 0; i < tool->n_points; i++) {
        const double h = shcd_dot(direction, tool->point_m[i]);
        if (h > most) {
            most = h;
            best = (int)i;
        }
    }
    return best;
}

static shcd_vec3 box_support(const shcd_tool_geometry *tool, shcd_vec3 d, int *index) {
    const shcd_vec3 m = tool->middle_m, h = tool->half_m;
    *index = (d.x > 0.0) + 2 * (d.y > 0.0) + 4 * (d.z > 0.0);
    return shcd_vec3_make(m.x + (d.x > 0.0 ? h.x : -h.x), m.y + (d.y > 0.0 ? h.y : -h.y),
                          m.z + (d.z > 0.0 ? h.z : -h.z));
}

static shcd_vec3 support(const shcd_tool_geometry *tool, shcd_vec3 direction, int *index) {
    if (tool->kind != SHCD_TOOL_HULL) {
        return box_support(tool, direction, index);
    }
    *index = hull_support(tool, direction);
    return tool->point_m[*index];
}

shcd_vec3 shcdi_core_support(const shcd_tool_geometry *tool, shcd_vec3 direction) {
    int unused;
    return support(tool, direction, &unused);
}

/* The point of D farthest along -v. */
static corner farthest(const shcd_tool_geometry *tool, const shcd_vec3 *x, int n, shcd_vec3 v) {
    corner c;
    c.x = 0;
    double least = shcd_dot(v, x[0]);
    for (int i = 1; i < n; i++) {
        const double d = shcd_dot(v, x[i]);
        if (d < least) {
            least = d;
            c.x = i;
        }
    }
    c.y = support(tool, v, &c.index);
    c.d = shcd_sub(x[c.x], c.y);
    return c;
}

static void note_upper(const simplex *s, double distance, shcdi_core_gap *gap) {
    gap->upper = distance;
    gap->n_active = 0;
    gap->weight[0] = gap->weight[1] = gap->weight[2] = 0.0;
    gap->point = shcd_vec3_make(0.0, 0.0, 0.0);
    for (int i = 0; i < s->n; i++) {
        int is_new = 1;
        gap->weight[s->c[i].x] += s->weight[i];
        gap->point = shcd_mul_add(gap->point, s->weight[i], s->c[i].y);
        for (int k = 0; k < gap->n_active; k++) {
            is_new = is_new && gap->active[k] != s->c[i].index;
        }
        if (is_new && gap->n_active < 3) {
            gap->active[gap->n_active++] = s->c[i].index;
        }
    }
}

static int holds(const simplex *s, const corner *c) {
    for (int i = 0; i < s->n; i++) {
        if (s->c[i].x == c->x && s->c[i].index == c->index) {
            return 1;
        }
    }
    return 0;
}

void shcdi_core_gap_to(const shcd_tool_geometry *tool, const shcd_vec3 *x, int n, double tolerance,
                       double enough, shcdi_core_gap *gap) {
    simplex s;
    shcd_vec3 v = shcd_sub(x[0], tool->middle_m);
    s.n = 1;
    s.c[0] = farthest(tool, x, n, v);
    s.weight[0] = 1.0;
    v = s.c[0].d;
    gap->lower = 0.0;
    gap->u = shcd_vec3_make(0.0, 0.0, 0.0);
    double distance = shcd_norm(v);
    note_upper(&s, distance, gap);
    for (int step = 0; step < STEPS_MAX && distance > 0.0; step++) {
        const corner c = farthest(tool, x, n, v);
        const double lower = shcd_dot(v, c.d) / distance;
        if (lower > gap->lower) {
            gap->lower = lower;
            gap->u = shcd_scale(1.0 / distance, v);
        }
        /* a corner that is already there means that v is as good as arithmetic makes it */
        if (gap->upper - gap->lower <= tolerance || gap->lower >= enough || holds(&s, &c)) {
            return;
        }
        s.weight[s.n] = 0.0;
        s.c[s.n++] = c;
        if (reduce(&s)) {
            distance = 0.0;
            break;
        }
        v = combine(&s);
        const double next = shcd_norm(v);
        if (!(next < distance)) {
            return; /* rounding: no progress */
        }
        distance = next;
        note_upper(&s, distance, gap);
    }
    /* weights and point stay those of the last simplex outside */
    if (!(distance > 0.0) && !(gap->lower > 0.0)) {
        gap->upper = gap->lower = 0.0;
    }
}
