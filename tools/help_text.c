/* SPDX-License-Identifier: BSD-3-Clause */
/* The words of `shcd --help` and of its man pages; nothing else lives here. */
#include "help.h"

#include <stddef.h>

const char help_summary[] = "bodies as spherical harmonics: fit, inspect, query, convert";

const char help_introduction[] =
    "A body is a closed surface S(w) = sum c_lm Y_lm(w), w on the unit sphere, kept in a .shcd "
    "file. Lengths are in metres, in the frame of the mesh or of the coefficients; signed distance "
    "is negative inside; normals point outward.\n"
    "\n"
    "A file is written under a temporary name and renamed when it is complete: a command that "
    "fails leaves no output file behind.";

const char help_examples[] = "  shcd fit liver.obj --unit cm -o liver.shcd\n"
                             "  shcd info liver.shcd --json\n"
                             "  shcd query liver.shcd < points.csv > distances.csv\n"
                             "  shcd surface liver.shcd --subdivide 6 -o liver.ply\n"
                             "  shcd coefficients liver.shcd --complex -o liver.csv\n"
                             "  shcd create liver.csv -o copy.shcd\n"
                             "  shcd cost liver.shcd --plot cost.svg\n"
                             "  shcd modes liver.shcd --anchor 0,0,-0.04,0.03 -o held.shcd\n"
                             "  shcd train liver.shcd --beta 1 -o soft.shcd --plot test.svg";

static const char fit_text[] =
    "Reads OBJ, PLY, STL or OFF, joins the parts of the file, merges vertices of equal position, "
    "checks that the mesh is one closed surface of genus 0 and fits a series to it. What was "
    "repaired, the errors against the mesh and the time go to standard output; warnings and, on a "
    "terminal, progress go to standard error.\n"
    "\n"
    "A body smaller than 1 mm or larger than 10 m brings a warning, since a wrong unit is the "
    "usual cause; so does a surface that intersects itself, or an error larger than the thinnest "
    "part of the mesh.\n"
    "\n"
    "The file is read in a process of its own with limits on memory and time, so that a broken or "
    "hostile one ends in a message. Positions pass through single precision: the report states its "
    "rounding, 2^-24 of the largest coordinate (text OBJ, STL and OFF may be off by three times "
    "that), and a warning follows if it exceeds 1e-5 of the diagonal or the tolerance: then the "
    "mesh should be moved closer to its origin.\n"
    "\n"
    "The body carries the lowest modes of its surface, which soft effects need; 'shcd modes' "
    "changes them. A surface whose modes do not settle brings a warning and a body without modes, "
    "or a failure if --modes was given.\n"
    "\n"
    "This command needs libshcd-fit; a build without it says so and fails.";

static const char modes_text[] =
    "Computes the modes of the body's surface, the vibrations of a membrane of its shape, which "
    "soft effects such as wave are made of, and writes a copy of the body with these modes in the "
    "place of its old ones. All else that the body carries stays, but for a learned response, "
    "which belongs to the old modes and is left out with a warning. OUT.shcd may be the body "
    "itself.\n"
    "\n"
    "The quadrature is refined until no eigenvalue changes by more than 1e-8 of (eigenvalue + "
    "1/area). Prints the number of modes, the range of eigenvalues, that agreement, and area and "
    "volume of the body by the same quadrature. 'shcd info --json' lists all eigenvalues. Takes "
    "0.2 s at degree 15, 4 s at 30 and a minute at 45.\n"
    "\n"
    "This command needs libshcd-fit; a build without it says so and fails.";

static const char info_text[] =
    "Prints the size, bounds, topology and fit errors that are stored in the body or derived when "
    "it is loaded. \"proven\" follows from a bound; \"sampled\" was seen on samples, finer detail "
    "may differ.";

static const char query_text[] =
    "Reads points from standard input, one x,y,z a line, in metres and in the body frame. Blank "
    "lines and lines that start with # are passed over, and the first line may be the header "
    "x,y,z. Writes to standard output this header and one row for each point, in the order of the "
    "input, numbers with 17 digits:\n"
    "\n"
    "  x,y,z,distance,lower,upper,cx,cy,cz,nx,ny,nz,flags\n"
    "\n"
    "distance is signed, negative inside; lower <= true signed distance <= upper is proven; "
    "(cx,cy,cz) is the closest point of the surface and (nx,ny,nz) its outward unit normal. flags "
    "is empty or holds names joined by |: truncated (a cap was met before the interval was tight), "
    "sign_unsure (inside or outside is not proven; lower and upper cover both), not_stationary "
    "(the "
    "closest point is not refined), map_edge (the map's neighbouring texels disagree), radial "
    "(distance is the depth along the ray from the centre, not the distance).\n"
    "\n"
    "A line that is not three finite numbers is named as stdin:LINE and ends the command with "
    "status 1; the rows before it have been written, whole. Rows are written as points arrive "
    "unless the input is a regular file, so another program may send one point at a time.";

static const char surface_text[] =
    "Evaluates the surface at the vertices of an icosahedron whose triangles are split in four N "
    "times: 10 4^N + 2 vertices and 20 4^N triangles, counter-clockwise seen from outside. The "
    "name of the output decides the format: .obj (text, 17 digits) or .ply (binary, "
    "little-endian, double precision). Coordinates are in metres.";

static const char coefficients_text[] =
    "Writes one row for each harmonic, l = 0 .. degree, m = -l .. l, in metres, numbers with 17 "
    "digits. The header tells the basis. Real, orthonormal, without the Condon-Shortley phase "
    "(m > 0 goes with cos(m phi), m < 0 with sin(|m| phi)):\n"
    "\n"
    "  l,m,x,y,z\n"
    "\n"
    "With --complex, orthonormal with the Condon-Shortley phase, as is usual in SPHARM papers:\n"
    "\n"
    "  l,m,x_re,x_im,y_re,y_im,z_re,z_im\n"
    "\n"
    "for m > 0: a_lm = (-1)^m (c_lm - i c_l,-m) / sqrt(2), a_l,-m = (-1)^m conj(a_lm).";

static const char create_text[] =
    "Reads a table as 'shcd coefficients' writes it; the header tells which of the two bases it "
    "is in. Rows may stand in any order; the largest l is the degree, and every (l,m) up to it "
    "must be there exactly once. Complex coefficients must belong to a real surface: a_l,-m = "
    "(-1)^m conj(a_lm) within 1e-6 of the largest coefficient, so that tables in single precision "
    "pass. Lines that start with # are passed over. COEFFICIENTS may be - for standard input.";

static const char cost_text[] =
    "Measures on this machine what a query costs and how far its answer is from the truth, for "
    "degrees of the series, tiers and distance maps, and for what else could hold the body's "
    "distance: uniform grids and an adaptive octree (ADF), built here from exact answers. Prints "
    "a table.\n"
    "\n"
    "The truth is the exact tier with the whole series. Errors of the signed distance, the normal "
    "and the force are those of the points within 1 % of the diagonal from the surface (the "
    "contact "
    "band); times are of one query, at random points within 5 % and on a path in steps of 0.1 % of "
    "the diagonal. The rows that no other row beats in both error and time, or "
    "error and memory, are marked.\n"
    "\n"
    "Takes about 20 seconds at degree 15 and 30 at degree 30 if nothing else runs. A trial decides "
    "how many points there are, fewer where queries are slow, and fields that would take too long "
    "to "
    "build are left out, which the table says. Other programs that run meanwhile disturb the "
    "times.";

static const char train_text[] =
    "Fits a network to the energy U(x, depth) that it takes to press the body in at a point x of "
    "its "
    "surface. The effect 'learned' of a scene makes forces of its gradient, so that no closed path "
    "yields energy.\n"
    "\n"
    "Without --samples the training data are computed: a membrane on the body's own surface, on an "
    "elastic foundation, whose tension grows with exp(beta |grad d|^2). With --beta 0 it is the "
    "static answer of the effect 'wave'. The body's modes are used (shcd modes); a body without "
    "them gets the default ones.\n"
    "\n"
    "A table has one indentation a line, in metres, newtons and joules, in the body's frame, under "
    "a header; the last two columns may be missing:\n"
    "\n"
    "  x,y,z,depth_m,force_n,energy_j,speed_m_per_s\n"
    "\n"
    "x,y,z is the contact point on the rest surface, depth_m how far it is pressed in along the "
    "inward normal, force_n the normal force on the tool, energy_j what it took, speed_m_per_s the "
    "speed of going in. At least 8 different points are needed; one in five is kept for the test. "
    "A "
    "bad line is named and ends the command. With energies the report says how far the forces are "
    "from their slope; with speeds a damping is found, F = dU/d depth + c depth speed.\n"
    "\n"
    "The errors on samples that the training did not see are stored in the body, printed, and "
    "drawn "
    "with --plot. A linear membrane takes seconds, a stiffening one minutes. This command needs "
    "libshcd-fit.";

static const char effects_text[] =
    "Prints the library's own table: what each effect does, its parameters with their defaults and "
    "ranges, and what it takes on this machine in a tick with one contact, measured while a ball "
    "slides over a body. An effect that a scene does not call for takes nothing.";

const command_help help_commands[] = {
    {"fit",
     "MESH -o BODY.shcd [--degree L | --tolerance M] [--unit UNIT] [options]",
     "fit a body to a closed triangle mesh",
     fit_text,
     {{"output", OPTION_OUTPUT, "BODY.shcd", "the file to write (required)"},
      {"degree", OPTION_DEGREE, "L", "degree of the series, 1 to 150; default 15"},
      {"tolerance", OPTION_TOLERANCE, "M",
       "instead of a degree: take the smallest one whose Hausdorff error against the mesh is at "
       "most M metres; 0.5mm and the like are understood"},
      {"degree-max", OPTION_DEGREE_MAX, "L",
       "with --tolerance: give up beyond this degree; default 50"},
      {"unit", OPTION_UNIT, "UNIT",
       "unit of the mesh file: m, cm, mm, um, in, or metres in one unit as a number; default m"},
      {"area-weight", OPTION_AREA_WEIGHT, "X",
       "weight of equal area against equal angles in the parameterization, > 0; default 5"},
      {"modes", OPTION_MODES, "N",
       "modes of the surface that the body carries, 0 to 1024 and at most (degree+1)^2; default "
       "64, or all if there are fewer"},
      {"json", OPTION_JSON, "REPORT",
       "write the report as JSON, too; - writes it to standard output in place of the text"},
      {"quiet", OPTION_QUIET, NULL, "no progress and no text report"},
      {"import-memory", OPTION_IMPORT_MEMORY, "MIB",
       "memory that reading the mesh may take; default 256 + 64 times the size of the file"},
      {"import-time", OPTION_IMPORT_TIME, "S",
       "processor time that reading the mesh may take, and a fourth of the time on the clock; "
       "default 10 + 4 for each MiB of the file"}}},
    {"info",
     "BODY.shcd [--json]",
     "print what a body is",
     info_text,
     {{"json", OPTION_JSON, NULL, "print JSON"}}},
    {"query",
     "BODY.shcd [--tier TIER] [--tolerance M] [options] < POINTS.csv > DISTANCES.csv",
     "signed distance and closest point of many points",
     query_text,
     {{"tier", OPTION_TIER, "TIER",
       "exact (default): the closest point, proven; fast: closest leaf and Newton, with a proven "
       "interval; map: depth along the ray from the centre, not a distance"},
      {"tolerance", OPTION_TOLERANCE, "M",
       "width of the interval, upper - lower, that is enough, in metres (0.1mm and the like are "
       "understood); twice that where sign_unsure makes the interval cover both sides; default "
       "1e-9 of the larger of the body's diagonal and the distance; not with --tier map"},
      {"interpolation", OPTION_INTERPOLATION, "KIND",
       "with --tier map: linear (default), or hermite: cubic and smooth, on the octahedral grid"},
      {"grid", OPTION_GRID, "GRID",
       "with --tier map: octahedral (default), or latlong: angles theta and phi, for comparison"},
      {"resolution", OPTION_RESOLUTION, "N",
       "with --tier map: make a map with steps of a quarter circle/N (octahedral) or a half "
       "circle/N (latlong), 2 to 512; default: the body's own map, 32, or 45 with latlong"}}},
    {"surface",
     "BODY.shcd -o OUT.obj|OUT.ply [--degree L] [--subdivide N]",
     "write the surface as a triangle mesh",
     surface_text,
     {{"output", OPTION_OUTPUT, "FILE", "the mesh to write (required)"},
      {"degree", OPTION_DEGREE, "L", "leave out harmonics above this degree; default all"},
      {"subdivide", OPTION_SUBDIVIDE, "N", "0 to 9; default 5 (20480 triangles)"}}},
    {"coefficients",
     "BODY.shcd [-o OUT.csv] [--complex]",
     "write the coefficients as CSV",
     coefficients_text,
     {{"output", OPTION_OUTPUT, "FILE", "the file to write; default standard output"},
      {"complex", OPTION_COMPLEX, NULL, "complex basis with the Condon-Shortley phase"}}},
    {"create",
     "COEFFICIENTS.csv -o BODY.shcd [--unit UNIT]",
     "make a body from coefficients in CSV",
     create_text,
     {{"output", OPTION_OUTPUT, "BODY.shcd", "the file to write (required)"},
      {"unit", OPTION_UNIT, "UNIT",
       "unit of the coefficients: m, cm, mm, um, in, or metres in one unit as a number; default "
       "m"}}},
    {"cost",
     "BODY.shcd [--mesh MESH] [--json FILE] [--plot FILE.svg|FILE.png] [-o COPY.shcd] [options]",
     "measure what accuracy costs in time and memory",
     cost_text,
     {{"output", OPTION_OUTPUT, "COPY.shcd",
       "save a copy of the body that carries the table, for scenes that state an accuracy; may be "
       "the body itself"},
      {"mesh", OPTION_MESH, "MESH",
       "the mesh that the body was fitted to: errors against it are given, too"},
      {"unit", OPTION_UNIT, "UNIT",
       "unit of the mesh file: m, cm, mm, um, in, or metres in one unit as a number; default the "
       "one that the body was fitted with"},
      {"json", OPTION_JSON, "FILE",
       "write all figures as JSON, too; - writes them to standard output in place of the table"},
      {"plot", OPTION_PLOT, "FILE",
       "draw error against time and error against memory; the name ends in .svg or .png; needs "
       "gnuplot"},
      {"points", OPTION_POINTS, "N",
       "number of random points, and of points of the path; default 20000, fewer for bodies with "
       "slow queries"},
      {"seed", OPTION_SEED, "N", "start of the random numbers; default 1"},
      {"stiffness", OPTION_STIFFNESS, "N_PER_M",
       "stiffness for which errors of the force are given, in N/m; default 500"},
      {"quick", OPTION_QUICK, NULL, "a few rows and points, in a few seconds: a trial"}}},
    {"modes",
     "BODY.shcd -o OUT.shcd [--modes N] [--anchor X,Y,Z,RADIUS[,ALPHA]]... [--quiet]",
     "compute the modes of a body's surface",
     modes_text,
     {{"output", OPTION_OUTPUT, "OUT.shcd", "the body to write (required)"},
      {"modes", OPTION_MODES, "N",
       "0 to 1024 and at most (degree+1)^2; default 64, or all if there are fewer; 0 writes a body "
       "without modes"},
      {"anchor", OPTION_ANCHOR, "A",
       "X,Y,Z,RADIUS or X,Y,Z,RADIUS,ALPHA in metres and 1/m^2: the surface nearer than RADIUS to "
       "the point is held back with alpha (1 - (d/RADIUS)^2)^4, d the distance; deflections die "
       "off over 1/sqrt(ALPHA) there; default ALPHA 16/RADIUS^2. May be given up to 64 times"},
      {"quiet", OPTION_QUIET, NULL, "no progress and no text"}}},
    {"train",
     "BODY.shcd -o OUT.shcd [--samples FILE.csv | --beta B] [options]",
     "teach a body how it answers a press",
     train_text,
     {{"output", OPTION_OUTPUT, "OUT.shcd",
       "the body with the learned response (required); may be the body itself"},
      {"samples", OPTION_SAMPLES, "FILE.csv",
       "train on this table instead of the built-in membrane; - reads standard input"},
      {"young", OPTION_YOUNG, "PA", "Young's modulus of the body, in pascals; default 5000"},
      {"poisson", OPTION_POISSON, "NU", "Poisson's ratio, below 0.4999; default 0.45"},
      {"beta", OPTION_BETA, "B", "stiffening, 0 to 10000; default 0: linear"},
      {"patch", OPTION_PATCH, "M", "radius of the contact patch; default 5mm"},
      {"support", OPTION_SUPPORT, "M", "length over which a dent dies off; default 20mm"},
      {"depth-max", OPTION_DEPTH_MAX, "M",
       "largest depth; default twice the patch radius, at most 5 % of the diagonal. Beyond it the "
       "force goes on with a constant stiffness"},
      {"n-samples", OPTION_N_SAMPLES, "N",
       "points that are pressed, each to five depths, 8 to 20000; default 600, or 450 with a "
       "stiffening"},
      {"seed", OPTION_SEED, "N", "start of the random numbers; default 1"},
      {"plot", OPTION_PLOT, "FILE", "draw the test; the name ends in .svg or .png; needs gnuplot"},
      {"json", OPTION_JSON, "FILE",
       "write the figures as JSON, too; - writes them to standard output in place of the text"},
      {"quiet", OPTION_QUIET, NULL, "no progress and no text report"}}},
    {"effects",
     "[--body BODY.shcd] [--markdown]",
     "list the effects that a scene may call for, and what they cost",
     effects_text,
     {{"body", OPTION_BODY, "BODY.shcd",
       "measure on this body; without it, on an ellipsoid of degree 15, which carries neither "
       "modes "
       "nor a learned response"},
      {"markdown", OPTION_MARKDOWN, NULL, "tables in Markdown, as in docs/effects.md"}}},
    {NULL, NULL, NULL, NULL, {{NULL, 0, NULL, NULL}}}};
