/* SPDX-License-Identifier: BSD-3-Clause */
/* Bytes -> events (libfyaml) -> tree.
 *
 * libfyaml is used for what it is good at, the syntax. What it is not good at is done around it. It
 * stops silently at bytes that are not text, so those are found first. Its time grows with the
 * square of the number of directives, and at an opening bracket it holds all that follows until it
 * knows whether this is a key, 360 bytes for each further bracket: directives, and more brackets
 * and commas than a scene may have values, are refused first. It does not know what a scene may
 * use: anchors and the like are refused at the event that shows them. */
#define _POSIX_C_SOURCE 200809L
#include "yaml_reader.h"

#include <errno.h>
#include <fcntl.h>
#include <libfyaml.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define TOO_MANY "more than %d values in one file"

/* ---- bytes ----------------------------------------------------------------------------------- */

/* Opened without blocking, so that a named pipe is refused instead of waited for. */
static int open_regular(const yaml_tree *tree) {
    const int fd = open(tree->file, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0) {
        (void)yaml_fail_file(tree, "cannot be opened", errno);
        return -1;
    }
    struct stat status;
    const char *problem = NULL;
    if (fstat(fd, &status) != 0 || !(S_ISREG(status.st_mode) || S_ISDIR(status.st_mode))) {
        problem = "is not a regular file; a scene file is text";
    } else if (S_ISDIR(status.st_mode)) {
        problem = "is a directory; give the scene file in it";
    }
    if (problem != NULL) {
        (void)yaml_fail_file(tree, problem, 0);
        (void)close(fd);
        return -1;
    }
    return fd;
}

/* The file's bytes, at most one more than allowed, so that growth while reading shows too. */
static char *read_bytes(yaml_tree *tree, size_t *size) {
    const int fd = open_regular(tree);
    if (fd < 0) {
        return NULL;
    }
    char *bytes = yaml_allocate(tree, YAML_FILE_BYTES_MAX + 1);
    size_t used = 0;
    while (bytes != NULL && used < YAML_FILE_BYTES_MAX + 1) {
        const ssize_t n = read(fd, bytes + used, YAML_FILE_BYTES_MAX + 1 - used);
        if (n < 0 && errno == EINTR) {
            continue;
        }
        if (n < 0) {
            (void)yaml_fail_file(tree, "cannot be read", errno);
            bytes = NULL;
        } else if (n == 0) {
            break;
        } else {
            used += (size_t)n;
        }
    }
    (void)close(fd);
    if (bytes != NULL && used > YAML_FILE_BYTES_MAX) {
        (void)yaml_fail(tree, NULL, "the file is larger than 1 MiB");
        bytes = NULL;
    }
    *size = used;
    return bytes;
}

/* Length of the UTF-8 character at s, and the character; 0 if it is none (overlong forms and
 * surrogates included). */
static size_t decode(const unsigned char *s, size_t size, uint32_t *character) {
    const unsigned char c = s[0];
    const size_t n = c < 0x80 ? 1 : (c & 0xe0) == 0xc0 ? 2 : (c & 0xf0) == 0xe0 ? 3 : 4;
    if (n > size || (n == 4 && (c & 0xf8) != 0xf0)) {
        return 0;
    }
    static const uint32_t smallest[5] = {0, 0, 0x80, 0x800, 0x10000};
    uint32_t value = n == 1 ? c : c & (0x7fu >> n);
    for (size_t i = 1; i < n; i++) {
        if ((s[i] & 0xc0) != 0x80) {
            return 0;
        }
        value = (value << 6) | (s[i] & 0x3fu);
    }
    *character = value;
    const bool wrong =
        value < smallest[n] || value > 0x10ffff || (value >= 0xd800 && value < 0xe000);
    return wrong ? 0 : n;
}

static bool is_text_character(uint32_t c) {
    return c == '\t' || c == '\n' || c == '\r' ||
           (c >= 0x20 && c != 0x7f && !(c >= 0x80 && c < 0xa0) && c != 0xfffe && c != 0xffff);
}

static bool check_text(const yaml_tree *tree, const char *bytes, size_t size) {
    const unsigned char *s = (const unsigned char *)bytes;
    yaml_place at = {1, 1};
    size_t n = 0;
    size_t n_values = 0;
    for (size_t i = 0; i < size; i += n) {
        uint32_t c = 0;
        n = decode(s + i, size - i, &c);
        if (n == 0) {
            return yaml_fail_at(tree, at, NULL, NULL,
                                "byte 0x%02x is not UTF-8; a scene file is text", (unsigned)s[i]);
        }
        if (!is_text_character(c)) {
            return yaml_fail_at(tree, at, NULL, NULL,
                                "control character U+%04X; a scene file is plain text",
                                (unsigned)c);
        }
        if (c == '%' && at.column == 1) {
            return yaml_fail_at(tree, at, NULL, NULL,
                                "YAML directives are not accepted; remove the line");
        }
        n_values += c == '[' || c == '{' || c == ',' ? 1 : 0;
        if (n_values > YAML_NODES_MAX) {
            return yaml_fail_at(tree, at, NULL, NULL, TOO_MANY, YAML_NODES_MAX);
        }
        if (c == '\n' || (c == '\r' && (i + 1 == size || s[i + 1] != '\n'))) {
            at.line++;
            at.column = 1;
        } else if (c != '\r') {
            at.column++;
        }
    }
    return true;
}

/* ---- events to tree -------------------------------------------------------------------------- */

typedef struct builder {
    yaml_tree *tree;
    yaml_node *open; /* the innermost map or list that has not ended */
    yaml_node *key;  /* read, its value not yet */
    unsigned depth;
    unsigned n_documents;
    yaml_place at; /* of the last event that had one */
} builder;

/* Names the value that is being read, wherever the parser stopped. */
static bool __attribute__((format(printf, 3, 4)))
fail_here(const builder *b, yaml_place at, const char *format, ...) {
    char excerpt[YAML_EXCERPT_SIZE];
    va_list arguments;
    va_start(arguments, format);
    char message[256];
    (void)vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    return yaml_fail_at(b->tree, at, b->open, b->key != NULL ? yaml_excerpt(b->key, excerpt) : NULL,
                        "%s", message);
}

/* libfyaml's marks count from 0; those of quoted scalars, anchors, aliases and tags stand behind
 * the character that introduces them. */
static yaml_place place_of_token(struct fy_token *token, yaml_place otherwise) {
    const struct fy_mark *mark = token != NULL ? fy_token_start_mark(token) : NULL;
    if (mark == NULL) {
        return otherwise;
    }
    const yaml_place at = {(unsigned)mark->line + 1, (unsigned)mark->column + 1};
    return at;
}

static yaml_place one_before(yaml_place at) {
    at.column -= at.column > 1 ? 1 : 0;
    return at;
}

static bool attach(builder *b, yaml_node *node) {
    yaml_node *parent = b->open;
    node->parent = parent;
    if (parent == NULL) {
        b->tree->root = node;
        return true;
    }
    if (parent->kind == YAML_MAP) {
        if (b->key == NULL) {
            if (node->kind != YAML_SCALAR) {
                return fail_here(b, node->at, "a map or list cannot be a key; keys are text");
            }
            b->key = node;
            return true;
        }
        node->key = b->key;
        b->key = NULL;
    }
    node->index = parent->count++;
    if (parent->last != NULL) {
        parent->last->next = node;
    } else {
        parent->first = node;
    }
    parent->last = node;
    return true;
}

static bool check_event(const builder *b, struct fy_event *event) {
    if (event->type == FYET_ALIAS) {
        return fail_here(b, one_before(place_of_token(event->alias.anchor, b->at)),
                         "aliases (*name) are not accepted; write the value out");
    }
    struct fy_token *anchor = fy_event_get_anchor_token(event);
    if (anchor != NULL) {
        return fail_here(b, one_before(place_of_token(anchor, b->at)),
                         "anchors (&name) are not accepted; write each value where it is used");
    }
    struct fy_token *tag = fy_event_get_tag_token(event);
    if (tag != NULL) {
        return fail_here(b, place_of_token(tag, b->at),
                         "tags (!name) are not accepted; the key already says the type");
    }
    if (b->tree->n_nodes >= YAML_NODES_MAX) {
        return fail_here(b, b->at, TOO_MANY, YAML_NODES_MAX);
    }
    return true;
}

static bool copy_scalar(builder *b, struct fy_token *token, yaml_node *node) {
    size_t length = 0;
    const char *text = token != NULL ? fy_token_get_text(token, &length) : "";
    char *copy = text != NULL ? yaml_allocate(b->tree, length + 1) : NULL;
    if (copy == NULL) {
        return text != NULL ? false : fail_here(b, b->at, "out of memory");
    }
    memcpy(copy, text, length);
    node->text = copy;
    node->length = length;
    const enum fy_scalar_style style = token != NULL ? fy_token_scalar_style(token) : FYSS_PLAIN;
    node->is_plain = style == FYSS_PLAIN;
    if (style == FYSS_SINGLE_QUOTED || style == FYSS_DOUBLE_QUOTED) {
        node->at = one_before(node->at);
    }
    return true;
}

static bool add_node(builder *b, struct fy_event *event) {
    if (!check_event(b, event)) {
        return false;
    }
    yaml_node *node = yaml_allocate(b->tree, sizeof *node);
    if (node == NULL) {
        return false;
    }
    b->tree->n_nodes++;
    /* a value that is left out has no mark of its own: its key stands for it */
    const bool marked = fy_event_start_mark(event) != NULL;
    node->at = marked || b->key == NULL ? b->at : b->key->at;
    node->text = "";
    if (event->type == FYET_SCALAR) {
        return copy_scalar(b, event->scalar.value, node) && attach(b, node);
    }
    node->kind = event->type == FYET_MAPPING_START ? YAML_MAP : YAML_LIST;
    if (b->depth >= YAML_DEPTH_MAX) {
        return fail_here(b, node->at, "nested deeper than %d levels", YAML_DEPTH_MAX);
    }
    if (!attach(b, node)) {
        return false;
    }
    b->open = node;
    b->depth++;
    return true;
}

static bool take_event(builder *b, struct fy_event *event) {
    const struct fy_mark *mark = fy_event_start_mark(event);
    if (mark != NULL) {
        const yaml_place at = {(unsigned)mark->line + 1, (unsigned)mark->column + 1};
        b->at = at;
    }
    switch (event->type) {
    case FYET_DOCUMENT_START:
        return b->n_documents++ == 0 ||
               fail_here(b, b->at, "a second document starts here; one file is one scene");
    case FYET_MAPPING_START:
    case FYET_SEQUENCE_START:
    case FYET_SCALAR:
    case FYET_ALIAS:
        return add_node(b, event);
    case FYET_MAPPING_END:
    case FYET_SEQUENCE_END:
        b->open = b->open->parent;
        b->depth--;
        return true;
    default:
        return true;
    }
}

/* ---- the parser ------------------------------------------------------------------------------ */

static void drop_output(struct fy_diag *diag, void *user, const char *text, size_t size) {
    (void)diag;
    (void)user;
    (void)text;
    (void)size;
}

/* Collects complaints instead of printing them. */
static struct fy_diag *create_diag(void) {
    struct fy_diag_cfg configuration;
    fy_diag_cfg_default(&configuration);
    configuration.fp = NULL;
    configuration.output_fn = drop_output;
    configuration.colorize = false;
    struct fy_diag *diag = fy_diag_create(&configuration);
    if (diag != NULL) {
        fy_diag_set_collect_errors(diag, true);
    }
    return diag;
}

static bool fail_syntax(const builder *b, struct fy_diag *diag) {
    void *iterator = NULL;
    const struct fy_diag_error *first = fy_diag_errors_iterate(diag, &iterator);
    if (first == NULL || first->msg == NULL) {
        return fail_here(b, b->at, "not valid YAML behind this place");
    }
    const yaml_place at = {first->line > 0 ? (unsigned)first->line : 1,
                           first->column > 0 ? (unsigned)first->column : 1};
    return fail_here(b, at, "not valid YAML: %s", first->msg);
}

static bool build(builder *b, struct fy_parser *parser, struct fy_diag *diag) {
    bool good = true;
    for (struct fy_event *event; good && (event = fy_parser_parse(parser)) != NULL;) {
        good = take_event(b, event);
        fy_parser_event_free(parser, event);
    }
    if (!good) {
        return false;
    }
    void *iterator = NULL;
    if (fy_parser_get_stream_error(parser) || fy_diag_errors_iterate(diag, &iterator) != NULL) {
        return fail_syntax(b, diag);
    }
    if (b->tree->root == NULL) {
        return yaml_fail(b->tree, NULL, "the file holds no scene; see docs/scene-file.md");
    }
    return true;
}

bool yaml_read(yaml_tree *tree) {
    size_t size = 0;
    const char *bytes = read_bytes(tree, &size);
    if (bytes != NULL && size >= 3 && memcmp(bytes, "\xef\xbb\xbf", 3) == 0) {
        bytes += 3; /* a byte order mark, as some editors write it */
        size -= 3;
    }
    if (bytes == NULL || !check_text(tree, bytes, size)) {
        return false;
    }
    builder b = {.tree = tree, .at = {1, 1}};
    bool good = false;
    struct fy_diag *diag = create_diag();
    const struct fy_parse_cfg configuration = {.flags = FYPCF_QUIET | FYPCF_COLLECT_DIAG |
                                                        FYPCF_DEFAULT_VERSION_1_2 | FYPCF_JSON_NONE,
                                               .diag = diag};
    struct fy_parser *parser = diag != NULL ? fy_parser_create(&configuration) : NULL;
    if (parser == NULL || fy_parser_set_string(parser, bytes, size) != 0) {
        (void)yaml_fail(tree, NULL, "out of memory");
    } else {
        good = build(&b, parser, diag);
    }
    if (parser != NULL) {
        fy_parser_destroy(parser);
    }
    if (diag != NULL) {
        fy_diag_destroy(diag);
    }
    return good;
}
