/* SPDX-License-Identifier: BSD-3-Clause */
/* The tree's memory, and its complaints: one line each, with the place and the path of the value.
 */
#include "yaml_tree.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- memory ---------------------------------------------------------------------------------- */

struct yaml_block {
    struct yaml_block *next;
    _Alignas(max_align_t) unsigned char bytes[];
};

void *yaml_allocate(yaml_tree *tree, size_t size) {
    struct yaml_block *block = calloc(1, sizeof *block + size);
    if (block == NULL) {
        (void)yaml_fail(tree, NULL, "out of memory");
        return NULL;
    }
    block->next = tree->blocks;
    tree->blocks = block;
    return block->bytes;
}

void yaml_release(yaml_tree *tree) {
    while (tree->blocks != NULL) {
        struct yaml_block *next = tree->blocks->next;
        free(tree->blocks);
        tree->blocks = next;
    }
    tree->root = NULL;
}

/* ---- complaints ------------------------------------------------------------------------------ */

/* Appends to a fixed buffer; what does not fit is dropped. */
typedef struct writer {
    char *text;
    size_t size, used;
} writer;

static void __attribute__((format(printf, 2, 0)))
write_list(writer *w, const char *format, va_list arguments) {
    if (w->used + 1 >= w->size) {
        return;
    }
    const int n = vsnprintf(w->text + w->used, w->size - w->used, format, arguments);
    if (n > 0) {
        const size_t room = w->size - w->used - 1;
        w->used += (size_t)n < room ? (size_t)n : room;
    }
}

static void __attribute__((format(printf, 2, 3))) write_text(writer *w, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    write_list(w, format, arguments);
    va_end(arguments);
}

/* A complaint quotes the file: nothing in it may break the line or talk to a terminal. C1 controls
 * are two bytes in UTF-8, 0xc2 and 0x80 .. 0x9f. */
static void make_printable(char *text) {
    for (unsigned char *c = (unsigned char *)text; *c != 0; c++) {
        if (*c < 0x20 || *c == 0x7f) {
            *c = '?';
        } else if (*c == 0xc2 && c[1] >= 0x80 && c[1] <= 0x9f) {
            c[0] = c[1] = '?';
        }
    }
}

const char *yaml_resolve_path(yaml_tree *tree, const char *path) {
    const char *slash = strrchr(tree->file, '/');
    const size_t folder = path[0] != '/' && slash != NULL ? (size_t)(slash - tree->file) + 1 : 0;
    const size_t length = strlen(path);
    char *resolved = yaml_allocate(tree, folder + length + 1);
    if (resolved != NULL) {
        memcpy(resolved, tree->file, folder);
        memcpy(resolved + folder, path, length + 1);
    }
    return resolved;
}

const char *yaml_excerpt(const yaml_node *node, char buffer[static YAML_EXCERPT_SIZE]) {
    const size_t room = YAML_EXCERPT_SIZE - 4;
    size_t n = strlen(node->text);
    if (n <= room) {
        memcpy(buffer, node->text, n + 1);
        return buffer;
    }
    n = room;
    while (n > 0 && ((unsigned char)node->text[n] & 0xc0) == 0x80) {
        n--; /* not inside a UTF-8 character */
    }
    memcpy(buffer, node->text, n);
    memcpy(buffer + n, "...", 4);
    return buffer;
}

static void write_path(writer *w, const yaml_node *node, const char *key) {
    const yaml_node *steps[YAML_DEPTH_MAX + 2];
    size_t n = 0;
    char excerpt[YAML_EXCERPT_SIZE];
    for (; node != NULL && node->parent != NULL && n < YAML_DEPTH_MAX + 2; node = node->parent) {
        steps[n++] = node;
    }
    if (n == 0 && key == NULL) {
        write_text(w, "scene");
    }
    for (size_t i = n; i-- > 0;) {
        if (steps[i]->key != NULL) {
            write_text(w, "%s%s", i + 1 < n ? "." : "", yaml_excerpt(steps[i]->key, excerpt));
        } else {
            write_text(w, "[%zu]", steps[i]->index);
        }
    }
    if (key != NULL) {
        write_text(w, "%s%s", n > 0 ? "." : "", key);
    }
}

static void __attribute__((format(printf, 5, 0)))
complain(const yaml_tree *tree, yaml_place at, const yaml_node *node, const char *key,
         const char *format, va_list arguments) {
    if (tree->error == NULL || tree->error_size == 0) {
        return;
    }
    writer w = {tree->error, tree->error_size, 0};
    tree->error[0] = '\0';
    write_text(&w, "%s:%u:%u: ", tree->file, at.line, at.column);
    write_path(&w, node, key);
    write_text(&w, ": ");
    write_list(&w, format, arguments);
    make_printable(tree->error);
}

bool yaml_fail_at(const yaml_tree *tree, yaml_place at, const yaml_node *node, const char *key,
                  const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    complain(tree, at, node, key, format, arguments);
    va_end(arguments);
    return false;
}

static yaml_place place_of(const yaml_node *node) {
    static const yaml_place start = {1, 1};
    return node != NULL ? node->at : start;
}

bool yaml_fail(const yaml_tree *tree, const yaml_node *node, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    complain(tree, place_of(node), node, NULL, format, arguments);
    va_end(arguments);
    return false;
}

bool yaml_fail_at_key(const yaml_tree *tree, const yaml_node *node, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    complain(tree, place_of(node->key != NULL ? node->key : node), node, NULL, format, arguments);
    va_end(arguments);
    return false;
}

bool yaml_fail_missing(const yaml_tree *tree, const yaml_node *map, const char *key,
                       const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    complain(tree, place_of(map), map, key, format, arguments);
    va_end(arguments);
    return false;
}

bool yaml_fail_file(const yaml_tree *tree, const char *message, int reason) {
    if (tree->error != NULL && tree->error_size > 0) {
        writer w = {tree->error, tree->error_size, 0};
        tree->error[0] = '\0';
        write_text(&w, "%s: %s", tree->file, message);
        if (reason != 0) {
            write_text(&w, ": %s", strerror(reason));
        }
        make_printable(tree->error);
    }
    return false;
}
