# SPDX-License-Identifier: BSD-3-Clause
# What a soft body does under a tool, against time, from the table of the C client:
#     gnuplot -c plot_soft.gp SOFT.csv OUT.svg OUT.png
# Four rows: force, penetration, displacement of the surface under the tool, energy. The energy that
# the tool has given is the sum of -F . dx, F held from one answer to the next.
set datafile separator comma
set encoding utf8

set grid xtics ytics back linetype 1 linewidth 1 linecolor rgb "#dcdcdc"
set border 3 lc rgb "#404040"
set tics nomirror
set xrange [0:*]
set offsets 0, 0, graph 0.08, 0
set lmargin 11
set rmargin 3
set key top right opaque noautotitle samplen 2

given = 0.0
last_x = 0.0
last_y = 0.0
last_z = 0.0
force_x = 0.0
force_y = 0.0
force_z = 0.0
has_last = 0
# the work of the force held since the last row, then this row's force and place
work(x, y, z, fx, fy, fz) = (\
    given = given - (has_last ? force_x * (x - last_x) + force_y * (y - last_y) \
                                + force_z * (z - last_z) : 0.0), \
    has_last = 1, last_x = x, last_y = y, last_z = z, \
    force_x = fx, force_y = fy, force_z = fz, given)

do for [format in "svg png"] {
    if (format eq "svg") {
        set terminal svg size 900, 900 dynamic enhanced font "DejaVu Sans,13" background "#ffffff"
        set output ARG2
    } else {
        set terminal pngcairo size 1350, 1350 enhanced font "DejaVu Sans,13" background "#ffffff"
        set output ARG3
    }
    given = 0.0
    has_last = 0
    set multiplot layout 4, 1
    unset xlabel
    set format x ""
    set bmargin 0.7
    set tmargin 1
    set ylabel "force on the tool [N]"
    plot ARG1 every ::1 using 1:(sqrt($7**2 + $8**2 + $9**2)) with lines lw 2 lc rgb "#c0392b"
    set ylabel "penetration [mm]"
    plot ARG1 every ::1 using 1:(1e3 * $10) with lines lw 2 lc rgb "#2471a3"
    set ylabel "surface displacement [mm]"
    plot ARG1 every ::1 using 1:(1e3 * $14) with lines lw 2 lc rgb "#1e8449"
    set xlabel "time [s]"
    set format x "%g"
    set bmargin 3.3
    set ylabel "energy [mJ]"
    plot ARG1 every ::1 using 1:(1e3 * work($4, $5, $6, $7, $8, $9)) with lines lw 2 \
             lc rgb "#7d3c98" title "given by the tool", \
         ARG1 every ::1 using 1:(1e3 * $15) with steps lw 2 lc rgb "#b9770e" \
             title "stored, by the status message (10 Hz)"
    unset multiplot
    unset output
}
