# SPDX-License-Identifier: BSD-3-Clause
# Force and penetration against time, from the table of a client:
#     gnuplot -c plot_force.gp PRESS.csv OUT.svg OUT.png
set datafile separator comma
set encoding utf8

set grid xtics ytics back linetype 1 linewidth 1 linecolor rgb "#dcdcdc"
set border 3 lc rgb "#404040"
set tics nomirror
set xrange [0:*]
set yrange [0:*]
set offsets 0, 0, graph 0.08, 0
set lmargin 9
set rmargin 3

do for [format in "svg png"] {
    if (format eq "svg") {
        set terminal svg size 900, 600 dynamic enhanced font "DejaVu Sans,13" background "#ffffff"
        set output ARG2
    } else {
        set terminal pngcairo size 1350, 900 enhanced font "DejaVu Sans,13" background "#ffffff"
        set output ARG3
    }
    set multiplot layout 2, 1
    unset xlabel
    set format x ""
    set ylabel "force on the tool [N]"
    set bmargin 1
    set tmargin 1.5
    plot ARG1 every ::1 using 1:(sqrt($7**2 + $8**2 + $9**2)) with lines lw 2 lc rgb "#c0392b" \
        notitle
    set xlabel "time [s]"
    set format x "%g"
    set ylabel "penetration [mm]"
    set bmargin 3.5
    set tmargin 0.5
    plot ARG1 every ::1 using 1:(1e3 * $10) with lines lw 2 lc rgb "#2471a3" notitle
    unset multiplot
    unset output
}
