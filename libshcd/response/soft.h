/* SPDX-License-Identifier: BSD-3-Clause */
/* A body that deforms: the membrane of the effect `wave`, driven by `pulse`.
 *
 * Displacement d(w) = sum_k q_k b_k phi_k(w), q_k in R^3 [m^2], phi_k [1/m] the modes of the body's
 * rest surface, b_k = exp(-sigma^2 lambda_k/2) the heat-kernel patch of radius a = 2 sigma. Each
 * mode is an oscillator under the contact forces f_i, held over the tick,
 *
 *     q_k'' + 2 zeta omega_k q_k' + omega_k^2 q_k = b_k sum_i phi_k(w_i) f_i / (rho h),
 *     omega_k^2 = (G lambda_k + kappa/h)/rho,
 *
 * and what pushes it is weighted as what moves the surface: contact is passive.
 *
 * A tick: the modes go on freely to its end (soft_modes.c, propagator.c); the surface that results
 * is queried; the forces follow implicitly from how much each of them would have moved that surface
 * by the end of the tick (soft_contact.c); their share is added to the modes. */
#ifndef SHCDI_SOFT_H
#define SHCDI_SOFT_H

#include "model/surface.h"
#include "response/account.h"
#include "response/effects.h"
#include "shcd/shape.h"

#include <stdbool.h>

/** How much of an effect acts, between 0 and 1. */
typedef struct shcdi_gain {
    double now;
    double target;     /**< 0 or 1 */
    double rate_per_s; /**< towards it */
} shcdi_gain;

/** Most contacts of a body that are solved together; beyond them a contact is felt, and does not
 *  move the body. */
#define SHCDI_PRESSES_MAX 24

/** How one mode goes on over a tick of a given length.
 *
 *  Kept are (x, y) = (omega_d q, q' + zeta omega q) where the motion is a decaying turn in these,
 *  and (q, q') where it is not (nearly critical, overdamped, or no spring). A turn is made of three
 *  shears: the determinant is 1 whatever is rounded, so undamped energy cannot drift. */
typedef struct shcdi_propagator {
    double lift;      /**< turn: tan(rest/2), the angle being n_quarters pi/2 + rest */
    double sine;      /**< sin(rest) */
    double decay;     /**< e^(-zeta omega T) */
    double matrix[4]; /**< else: q <- m0 q + m1 q', q' <- m2 q + m3 q' */
    double forced_x;  /**< what a unit of held acceleration adds to x and y in a tick */
    double forced_y;
    double forced_q_s2; /**< and to q: the one-tick compliance c_k */
    int32_t n_quarters; /**< 0 .. 3 */
    int32_t reserved0;
} shcdi_propagator;

/** One mode's constants. */
typedef struct shcdi_mode {
    double omega_rad_per_s;
    double q_of_x;      /**< 1/omega_d, or 1 where x is q */
    double decay_per_s; /**< zeta omega */
    int32_t is_turn;
    int32_t reserved0;
} shcdi_mode;

/** What is constant. Inside the scene's block, followed by its arrays. */
typedef struct shcdi_soft {
    const shcd_model *model;
    size_t n_modes;
    size_t n_harmonics;
    size_t n_groups;     /**< of three modes, evaluated like the coordinates of a surface */
    int32_t wave, pulse; /**< index among the body's effects; -1: none */
    int32_t law;         /**< likewise, of the contacts' elastic law; -1: they are rigid */
    int32_t reserved0;
    double mass_kg_per_m2;   /**< rho h */
    double residual_m_per_n; /**< compliance of the modes that are left out */
    shcdi_mode *mode;        /**< n_modes */
    double *q_of_x;          /**< n_modes, as in mode */
    double *shape_per_m;     /**< n_modes rows of `stride`: b_k v_ki, then zeros */
    size_t stride;           /**< n_harmonics, rounded up for the modal sums */
    double *packed;          /**< the same as n_groups series of packed_size values */
    size_t packed_size;
    shcd_vec3 *drive_m2; /**< n_modes: amplitude of pulse, statically; NULL without */
    double drive_hz, drive_share;
    size_t state_bytes;
} shcdi_soft;

/** A contact with a soft body. */
typedef struct shcdi_press {
    shcdi_touch touch;
    shcdi_response response;
    shcd_vec3 arm_m;       /**< from the tool's origin to where the normal force acts, world */
    shcd_vec3 other_arm_m; /**< to where other forces act */
    double share;          /**< of the body's response */
    uint64_t memory_at;    /**< of the effects, from the start of the state */
    uint32_t tool;
    uint32_t is_reported; /**< the contact that the tool's output describes */
    uint32_t is_wall;     /**< shares one spring with the other walls of the tool */
    uint32_t wall;        /**< which of them */
    double way_m;         /**< how far it moves the ball, if it has a law, ... */
    double way_share;     /**< ... its share of the whole way out, ... */
    double slope_n_per_m; /**< ... how fast the whole force rises with that, in a tick, ... */
    shcd_vec3 tilt;       /**< ... and what its slope is besides, since it turns */
} shcdi_press;

/** What changes, in the state; arrays and the shape follow, see soft.c. */
typedef struct shcdi_soft_state {
    double dt_s;         /**< for which the propagators are */
    double phase;        /**< of pulse, in turns, 0 .. 1 */
    double drive_work_j; /**< that pulse did on the modes since the start */
    double stored_j; /**< energy of the modes, and of what they leave out, after the last tick */
    uint32_t n_presses;
    uint32_t is_moving; /**< 0: in the rest shape, at rest */
    uint32_t is_tilted; /**< 0: `tilt` counts as zero */
    uint32_t reserved0;
    shcdi_account account; /**< of balls' contacts, from a second wall on */
    double law_n_per_m;    /**< largest slope of the law, while anything touches */
    double carried_work_j; /**< that the moving surface did on what rubs on it, since the start */
    double booked_work_j;  /**< drive_work_j that it has booked */
} shcdi_soft_state;

/** The parts of a body's memory. */
typedef struct shcdi_soft_parts {
    shcdi_soft_state *head;
    shcd_vec3 *x, *y;             /**< of the modes */
    shcdi_propagator *propagator; /**< of the modes */
    shcd_vec3 *drive;             /**< acceleration by pulse, held over the tick; of the modes */
    shcd_vec3 *before;            /**< q at the start of the tick, if pulse drives */
    shcd_vec3 *tilt;              /**< acceleration by walls that turn, held over the next tick */
    shcd_vec3 *trial;             /**< work space: acceleration of the modes */
    double *coefficients;         /**< 3 n_harmonics */
    double *at;                   /**< b_k phi_k at each contact, SHCDI_PRESSES_MAX rows */
    shcdi_press *press;
    shcd_shape *shape;
} shcdi_soft_parts;

shcdi_soft_parts shcdi_soft_parts_of(const shcdi_soft *soft, unsigned char *memory);

/** Checks what a soft body needs of its model and of its other effects. */
shcd_status shcdi_soft_check(const char *body, const shcd_model *model,
                             const shcdi_active_effect *effects, size_t n, shcd_error *error);

/** Bytes of the scene's block that a body with these effects needs; 0 for a rigid one. */
size_t shcdi_soft_bytes(const shcd_model *model, const shcdi_active_effect *effects, size_t n);

/** Fills it in zeroed memory of shcdi_soft_bytes(), aligned to 8. */
shcdi_soft *shcdi_soft_create(const shcd_model *model, const shcdi_active_effect *effects, size_t n,
                              unsigned char *memory);

/** Amplitudes of the modes for `pulse`; `work` holds 3 n_harmonics + 2 n_modes values. */
void shcdi_soft_drive(const double *constants, const shcd_model *model, shcdi_soft *soft,
                      double *work);

/** Initialises the zeroed memory of a body, aligned to 16. */
void shcdi_soft_init(const shcdi_soft *soft, unsigned char *memory);

const shcd_shape *shcdi_soft_shape(const shcdi_soft *soft, const unsigned char *memory);

/** How much of a soft body acts. With an elastic law of its own a contact goes over to that on a
 *  rigid body as the wave is switched off: what the modes show, and what pushes them, is scaled.
 *  Without one it goes over to nothing: the force is scaled, and what the modes show follows. */
typedef struct shcdi_soft_gain {
    double shown; /**< of the modes */
    double force; /**< of the contacts' force: of the law, or of the wave without one */
    double pulse;
} shcdi_soft_gain;

shcdi_soft_gain shcdi_soft_gain_of(const shcdi_soft *soft, const shcdi_gain *gains);

/** The modes go on freely to the end of the tick, and the shape follows; no contact is noted. */
void shcdi_soft_evolve(const shcdi_soft *soft, unsigned char *memory, shcdi_soft_gain gain,
                       double dt_s);

/** Displaced coefficients for what the modes are now, 3 n_harmonics. */
void shcdi_soft_coefficients(const shcdi_soft *soft, const unsigned char *memory, double shown,
                             double *coefficients);

/** Notes a contact at a parameter. @return NULL: there is no room */
shcdi_press *shcdi_soft_note(const shcdi_soft *soft, unsigned char *memory, shcd_vec3 parameter);

/** Velocity of the surface at a noted contact, as the modes are now. */
shcd_vec3 shcdi_soft_velocity(const shcdi_soft *soft, unsigned char *memory, size_t press,
                              double shown);

/** Adds what an acceleration held over the tick does to mode k. */
void shcdi_soft_push(const shcdi_soft_parts *parts, size_t k, shcd_vec3 acceleration);

/** Energy of the modes, and work of the drive, at the end of a tick. */
void shcdi_soft_account(const shcdi_soft *soft, unsigned char *memory);

/** Energy of the modes, if accelerations were held over the tick besides (NULL: none) [J].
 *  @param[out] drive_j  work of the drive in this tick, then */
double shcdi_soft_energy(const shcdi_soft *soft, unsigned char *memory,
                         const shcd_vec3 *acceleration, double *drive_j);

/** Solves for the normal forces of the noted contacts, depth_m of each response given, and moves
 *  the modes by them.
 *  @param[in] most_j  what modes and law may hold beyond the work of the drive: as much of the law
 * is withheld */
void shcdi_soft_press(const shcdi_soft *soft, unsigned char *memory, const shcdi_active_effect *law,
                      shcdi_soft_gain gain, double most_j);

/** After shcdi_soft_press(): what the walls of a tool push besides, since they turn as the ball and
 *  the surface move; soft_tilt.c. */
void shcdi_soft_tilt(const shcdi_soft *soft, unsigned char *memory, double shown);

/** How far these forces have moved the surface at a noted contact by the end of the tick: what the
 *  modes show, without what they leave out. After shcdi_soft_press(). */
shcd_vec3 shcdi_soft_motion(const shcdi_soft *soft, unsigned char *memory, size_t press,
                            double shown);

/** Order of the constants of `wave`. */
enum {
    SHCDI_WAVE_MODES,
    SHCDI_WAVE_YOUNG,
    SHCDI_WAVE_POISSON,
    SHCDI_WAVE_DENSITY,
    SHCDI_WAVE_PATCH,
    SHCDI_WAVE_SUPPORT,
    SHCDI_WAVE_THICKNESS,
    SHCDI_WAVE_DAMPING
};

/** Order of the constants of `pulse`. */
enum {
    SHCDI_PULSE_FREQUENCY,
    SHCDI_PULSE_AMPLITUDE,
    SHCDI_PULSE_SHARE,
    SHCDI_PULSE_MODE,
    SHCDI_PULSE_X,
    SHCDI_PULSE_Y,
    SHCDI_PULSE_Z
};

/** The membrane that the constants of `wave` describe. */
typedef struct shcdi_membrane {
    double shear_pa;            /**< G */
    double thickness_m;         /**< h */
    double foundation_pa_per_m; /**< kappa */
    double patch_m;             /**< sigma = a/2 */
    double density_kg_per_m3;
} shcdi_membrane;

shcdi_membrane shcdi_membrane_of(const double *wave);

/** Static compliance of all modes from number n on: e^x E1(sigma^2 (4 pi n/area + 1/l^2))/(4 pi G
 *  h). */
double shcdi_residual_compliance(const shcdi_membrane *membrane, double area_m2, size_t n);

/** e^x E1(x) with the exponential integral E1, x > 0; relative error below 1e-14. */
double shcdi_scaled_e1(double x);

/** For a mode with damping ratio zeta and a tick of dt_s. RT safe. */
void shcdi_propagator_set(const shcdi_mode *mode, double dt_s, shcdi_propagator *p);

void shcdi_mode_set(double omega_rad_per_s, double damping_ratio, shcdi_mode *mode);

/** One tick of free motion. RT safe. */
void shcdi_propagate(const shcdi_mode *mode, const shcdi_propagator *p, double *x, double *y);

#endif
