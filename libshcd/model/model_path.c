/* SPDX-License-Identifier: BSD-3-Clause */
/* Files: the only place of the library that touches the file system. */
#include "model/model.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

/* A model of degree 150 takes 0.55 MB; unknown chunks may add to it. */
#define FILE_SIZE_MAX ((size_t)64 << 20)

static shcd_status read_all(FILE *file, const char *path, const shcd_allocator *memory,
                            void **bytes, size_t *size, shcd_error *error) {
    size_t capacity = (size_t)1 << 16, n = 0;
    unsigned char *buffer = memory->allocate(capacity, memory->user);
    while (buffer != NULL) {
        n += fread(buffer + n, 1, capacity - n, file);
        if (n < capacity) {
            break;
        }
        if (capacity >= FILE_SIZE_MAX) {
            memory->release(buffer, memory->user);
            return shcdi_fail(error, SHCD_ERR_FORMAT, "%s: larger than %zu bytes", path,
                              FILE_SIZE_MAX);
        }
        unsigned char *larger = memory->allocate(2 * capacity, memory->user);
        if (larger != NULL) {
            memcpy(larger, buffer, n);
        }
        memory->release(buffer, memory->user);
        buffer = larger;
        capacity *= 2;
    }
    if (buffer == NULL) {
        return shcdi_fail(error, SHCD_ERR_MEMORY, "%s: out of memory", path);
    }
    if (ferror(file)) {
        memory->release(buffer, memory->user);
        return shcdi_fail(error, SHCD_ERR_IO, "%s: cannot be read", path);
    }
    *bytes = buffer;
    *size = n;
    return SHCD_OK;
}

shcd_status shcd_model_load(const char *path, const shcd_allocator *allocator, shcd_model **model,
                            shcd_error *error) {
    if (path == NULL || model == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "model_load: no path, or no place for the model");
    }
    const shcd_allocator memory = shcdi_allocator(allocator);
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return shcdi_fail(error, SHCD_ERR_IO, "%s: %s", path, strerror(errno));
    }
    void *bytes = NULL;
    size_t size = 0;
    shcd_status status = read_all(file, path, &memory, &bytes, &size, error);
    fclose(file);
    if (status != SHCD_OK) {
        return status;
    }
    shcd_error inner = {SHCD_OK, ""};
    status = shcd_model_read(bytes, size, allocator, model, &inner);
    memory.release(bytes, memory.user);
    if (status != SHCD_OK) {
        return shcdi_fail(error, status, "%.120s: %.120s", path, inner.message);
    }
    return SHCD_OK;
}

static shcd_status write_all(const char *path, const void *bytes, size_t size, shcd_error *error) {
    /* a name of its own beside the target: "x" refuses one that exists */
    char beside[4096];
    FILE *file = NULL;
    for (int i = 0; i < 100 && file == NULL; i++) {
        const int length = snprintf(beside, sizeof beside, "%s.part%d", path, i);
        if (length < 0 || (size_t)length >= sizeof beside) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT, "model_save: the path is too long");
        }
        file = fopen(beside, "wbx");
        if (file == NULL && errno != EEXIST) {
            break;
        }
    }
    if (file == NULL) {
        return shcdi_fail(error, SHCD_ERR_IO, "%s: %s", path, strerror(errno));
    }
    const int written = fwrite(bytes, 1, size, file) == size;
    if (fclose(file) != 0 || !written || rename(beside, path) != 0) {
        const int reason = errno;
        remove(beside);
        return shcdi_fail(error, SHCD_ERR_IO, "%s: %s", path, strerror(reason));
    }
    return SHCD_OK;
}

shcd_status shcd_model_save(const shcd_model *model, const char *path, shcd_error *error) {
    if (model == NULL || path == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "model_save: no model or no path");
    }
    const size_t size = shcd_model_write_size(model);
    const shcd_allocator *memory = &model->allocator;
    void *bytes = memory->allocate(size, memory->user);
    if (bytes == NULL) {
        return shcdi_fail(error, SHCD_ERR_MEMORY, "model_save: out of memory");
    }
    shcd_status status = shcd_model_write(model, bytes, size);
    if (status == SHCD_OK) {
        status = write_all(path, bytes, size, error);
    }
    memory->release(bytes, memory->user);
    return status;
}
