/* SPDX-License-Identifier: BSD-3-Clause */
/* Typed values out of a YAML tree. Numbers follow YAML's core schema for decimals, narrowed: no
 * leading zeros (older YAML reads 010 as octal), no nan, no inf, nothing behind the last digit. */
#define _POSIX_C_SOURCE 200809L
#include "yaml_value.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool yaml_equals(const yaml_node *node, const char *text) {
    const size_t length = strlen(text);
    return node->kind == YAML_SCALAR && node->length == length &&
           memcmp(node->text, text, length) == 0;
}

static const char *kind_name(const yaml_node *node) {
    if (node->kind == YAML_LIST) {
        return "a list";
    }
    if (node->kind == YAML_MAP) {
        return "a map";
    }
    return node->is_plain && node->length == 0 ? "empty" : "a single value";
}

/* ---- maps and lists -------------------------------------------------------------------------- */

static bool fail_unknown(const yaml_tree *tree, const yaml_node *node, const char *what,
                         const yaml_field *fields, size_t n_fields) {
    if (yaml_equals(node->key, "<<")) {
        return yaml_fail_at_key(tree, node, "merge keys are not accepted; write the keys out");
    }
    char known[512] = "";
    size_t used = 0;
    for (size_t i = 0; i < n_fields && used < sizeof known; i++) {
        const int n =
            snprintf(known + used, sizeof known - used, "%s%s", i > 0 ? ", " : "", fields[i].name);
        used += n > 0 ? (size_t)n : 0;
    }
    return yaml_fail_at_key(tree, node, "unknown %s; known here: %s", what,
                            n_fields > 0 ? known : "none");
}

bool yaml_fields(const yaml_tree *tree, const yaml_node *map, const char *what, yaml_field *fields,
                 size_t n_fields) {
    if (map->kind != YAML_MAP) {
        return yaml_fail(tree, map, "is %s, must be a map of key: value pairs (or {})",
                         kind_name(map));
    }
    for (const yaml_node *node = map->first; node != NULL; node = node->next) {
        yaml_field *field = NULL;
        for (size_t i = 0; i < n_fields && field == NULL; i++) {
            field = yaml_equals(node->key, fields[i].name) ? &fields[i] : NULL;
        }
        if (field == NULL) {
            return fail_unknown(tree, node, what, fields, n_fields);
        }
        if (field->node != NULL) {
            return yaml_fail_at_key(tree, node, "given twice, first in line %u; remove one",
                                    field->node->key->at.line);
        }
        field->node = node;
    }
    for (size_t i = 0; i < n_fields; i++) {
        if (fields[i].node == NULL && fields[i].required != NULL) {
            return yaml_fail_missing(tree, map, fields[i].name, "missing; must be %s",
                                     fields[i].required);
        }
    }
    return true;
}

bool yaml_list(const yaml_tree *tree, const yaml_node *node, const char *what, size_t count_min,
               size_t count_max) {
    if (node->kind != YAML_LIST) {
        return yaml_fail(tree, node, "is %s, must be a list of %s", kind_name(node), what);
    }
    if (node->count < count_min) {
        return yaml_fail(tree, node, "holds %zu %s, must hold at least %zu", node->count, what,
                         count_min);
    }
    if (node->count > count_max) {
        const yaml_node *excess = node->first;
        while (excess->index < count_max) {
            excess = excess->next;
        }
        return yaml_fail(tree, excess, "one too many; the list holds %zu %s, at most %zu fit",
                         node->count, what, count_max);
    }
    return true;
}

/* ---- numbers --------------------------------------------------------------------------------- */

static const char *skip_digits(const char *c) {
    while (*c >= '0' && *c <= '9') {
        c++;
    }
    return c;
}

/* [+-] (digits [. [digits]] | . digits) [(e|E) [+-] digits], and nothing else. */
static bool is_decimal(const yaml_node *node) {
    const char *c = node->text;
    c += *c == '+' || *c == '-' ? 1 : 0;
    const char *whole = c;
    c = skip_digits(c);
    size_t n_digits = (size_t)(c - whole);
    if (n_digits > 1 && *whole == '0') {
        return false;
    }
    if (*c == '.') {
        const char *fraction = ++c;
        c = skip_digits(c);
        n_digits += (size_t)(c - fraction);
    }
    if (n_digits == 0) {
        return false;
    }
    if (*c == 'e' || *c == 'E') {
        c++;
        c += *c == '+' || *c == '-' ? 1 : 0;
        const char *exponent = c;
        c = skip_digits(c);
        if (c == exponent) {
            return false;
        }
    }
    return (size_t)(c - node->text) == node->length;
}

static bool has_unit(const char *unit) {
    return unit != NULL && strcmp(unit, "1") != 0;
}

static bool fail_number(const yaml_tree *tree, const yaml_node *node, const char *unit) {
    char excerpt[YAML_EXCERPT_SIZE];
    if (node->kind != YAML_SCALAR || (node->is_plain && node->length == 0)) {
        return yaml_fail(tree, node, "is %s, must be a number%s%s", kind_name(node),
                         has_unit(unit) ? " in " : "", has_unit(unit) ? unit : "");
    }
    return yaml_fail(tree, node,
                     "'%s'%s is not a number; write it like 0.25 or 1.5e-3, without quotes or "
                     "unit%s%s%s",
                     yaml_excerpt(node, excerpt), node->is_plain ? "" : " (quoted)",
                     has_unit(unit) ? " (it is in " : "", has_unit(unit) ? unit : "",
                     has_unit(unit) ? ")" : "");
}

bool yaml_number(const yaml_tree *tree, const yaml_node *node, double min, double max,
                 const char *unit, double *value) {
    if (node->kind != YAML_SCALAR || !node->is_plain || !is_decimal(node)) {
        return fail_number(tree, node, unit);
    }
    /* the caller has set the C locale, in which strtod takes exactly what is_decimal() let pass */
    const double read = strtod(node->text, NULL);
    char excerpt[YAML_EXCERPT_SIZE];
    if (!isfinite(read) || read < min || read > max) {
        return yaml_fail(tree, node, "%s is out of range, must lie in %.9g .. %.9g%s%s",
                         yaml_excerpt(node, excerpt), min, max, has_unit(unit) ? " " : "",
                         has_unit(unit) ? unit : "");
    }
    if (read == 0.0 && strcspn(node->text, "123456789") < strcspn(node->text, "eE")) {
        return yaml_fail(tree, node, "%s is too close to zero to be kept; write 0",
                         yaml_excerpt(node, excerpt));
    }
    *value = read;
    return true;
}

bool yaml_numbers(const yaml_tree *tree, const yaml_node *node, size_t n, double min, double max,
                  const char *unit, double *values) {
    if (node->kind != YAML_LIST) {
        return yaml_fail(tree, node, "is %s, must be a list of %zu numbers%s%s", kind_name(node), n,
                         has_unit(unit) ? " in " : "", has_unit(unit) ? unit : "");
    }
    if (node->count != n) {
        return yaml_fail(tree, node, "holds %zu values, must hold %zu", node->count, n);
    }
    for (const yaml_node *item = node->first; item != NULL; item = item->next) {
        if (!yaml_number(tree, item, min, max, unit, &values[item->index])) {
            return false;
        }
    }
    return true;
}

bool yaml_integer(const yaml_tree *tree, const yaml_node *node, unsigned max, unsigned *value) {
    char excerpt[YAML_EXCERPT_SIZE];
    if (node->kind != YAML_SCALAR || node->length == 0) {
        return yaml_fail(tree, node, "is %s, must be a whole number, 0 .. %u", kind_name(node),
                         max);
    }
    unsigned long read = 0;
    bool good = node->is_plain && (node->length == 1 || node->text[0] != '0');
    for (size_t i = 0; i < node->length && good && read <= max; i++) {
        good = node->text[i] >= '0' && node->text[i] <= '9';
        read = 10 * read + (unsigned long)(good ? node->text[i] - '0' : 0);
    }
    if (!good || read > max) {
        return yaml_fail(tree, node, "'%s' is not a whole number in 0 .. %u",
                         yaml_excerpt(node, excerpt), max);
    }
    *value = (unsigned)read;
    return true;
}

/* ---- text ------------------------------------------------------------------------------------ */

static bool is_text(const yaml_node *node) {
    static const char *const others[] = {"",     "~",    "null",  "Null",  "NULL", "true",
                                         "True", "TRUE", "false", "False", "FALSE"};
    if (node->kind != YAML_SCALAR) {
        return false;
    }
    if (!node->is_plain) {
        return true;
    }
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        if (yaml_equals(node, others[i])) {
            return false;
        }
    }
    return !is_decimal(node);
}

bool yaml_text(const yaml_tree *tree, const yaml_node *node, size_t bytes_max, const char **text) {
    char excerpt[YAML_EXCERPT_SIZE];
    if (node->kind != YAML_SCALAR || (node->is_plain && node->length == 0)) {
        return yaml_fail(tree, node, "is %s, must be text", kind_name(node));
    }
    if (!is_text(node)) {
        return yaml_fail(tree, node, "%s is not text; write it in quotes if it is meant so",
                         yaml_excerpt(node, excerpt));
    }
    if (node->length == 0 || node->length > bytes_max) {
        return yaml_fail(tree, node, "is %zu bytes long, must be 1 .. %zu", node->length,
                         bytes_max);
    }
    for (size_t i = 0; i < node->length; i++) {
        const unsigned char c = (unsigned char)node->text[i];
        if (c < 0x20 || c == 0x7f) {
            return yaml_fail(tree, node, "holds the control character 0x%02x, must be plain text",
                             (unsigned)c);
        }
    }
    *text = node->text;
    return true;
}
