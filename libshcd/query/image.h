/* SPDX-License-Identifier: BSD-3-Clause */
/* A triangular patch of the parameter sphere together with the images of its corners. */
#ifndef SHCDI_QUERY_IMAGE_H
#define SHCDI_QUERY_IMAGE_H

#include "query/patch.h"

typedef struct shcdi_image {
    shcd_vec3 w[3]; /**< corners on the parameter sphere */
    shcd_vec3 x[3]; /**< S there */
} shcdi_image;

/** The four patches that the midpoints cut an image into: child 3 is the middle one, whose corners
 *  the caller fills with S at child[3].w before shcdi_image_complete(). RT safe. */
static inline void shcdi_image_split(const shcdi_image *image, shcdi_image child[4]) {
    shcd_vec3 w[4][3];
    shcdi_split(image->w, w);
    for (int k = 0; k < 4; k++) {
        for (int i = 0; i < 3; i++) {
            child[k].w[i] = w[k][i];
        }
    }
}

/** Hands the images of the corners on to the other three. RT safe. */
static inline void shcdi_image_complete(const shcdi_image *image, shcdi_image child[4]) {
    for (int i = 0; i < 3; i++) {
        child[i].x[i] = image->x[i];
        child[i].x[(i + 1) % 3] = child[3].x[i];
        child[i].x[(i + 2) % 3] = child[3].x[(i + 2) % 3];
    }
}

#endif
