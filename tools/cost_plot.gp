# SPDX-License-Identifier: BSD-3-Clause
# Error against time and against memory, for `shcd cost --plot`, which writes the data and the
# settings in front of this: blocks of lines "ns KB mm label", their lengths n_..., what they mean.
# Errors that the truth does not resolve stand on a line of their own at the bottom.
set encoding utf8
if (is_png) {
    set terminal pngcairo size 1950, 1020 enhanced font "DejaVu Sans,17" background "#ffffff"
    small = ",13"
    large = ",20"
} else {
    set terminal svg size 1300, 680 dynamic enhanced font "DejaVu Sans,13" background "#ffffff"
    small = ",10"
    large = ",16"
}
blue = "#1f5fa8"
orange = "#d9731a"
grey = "#6f6f6f"
dark = "#303030"
gold = "#ffe08a"
pale = "#e4e4e4"

set style line 1 lc rgb blue lw 2.4 pt 7 ps 1
set style line 2 lc rgb blue lw 1.4 pt 5 ps 0.8 dt 2
set style line 3 lc rgb blue lw 1.4 pt 9 ps 1 dt 3
set style line 4 lc rgb orange lw 1 pt 13 ps 1
set style line 5 lc rgb grey lw 1.4 pt 5 ps 0.8
set style line 6 lc rgb grey lw 1.4 pt 9 ps 1 dt 4

set multiplot layout 1, 2
set label 1 sprintf("What accuracy costs: %s, degree %d, diagonal %.4g mm", body, degree, \
    diagonal_mm) at screen 0.02, 0.965 font large textcolor rgb dark
set label 2 sprintf("Points within %.2g mm of the surface; %s; ○ Pareto front of the body; " \
    ."blue numbers: degrees", band_mm, cpu) at screen 0.02, 0.92 font small textcolor rgb grey

stats $exact using 1 every ::0::0 name "E" nooutput
stats $fast using 1 every ::0::0 name "F" nooutput
exact_first_ns = E_min
fast_first_ns = F_min

set logscale xy
set border 3 lc rgb dark
set tics nomirror textcolor rgb dark
set grid ytics lt 1 lw 0.7 lc rgb pale
set bmargin 4
set tmargin 5
set lmargin 11
set rmargin 3

# the line between what is resolved and what is not
gap_mm = sqrt(bottom_mm * low_mm)
set yrange [0.7 * bottom_mm : high_mm * (high_mm / bottom_mm) ** 0.26]
set format "%g"
set ytics 10 ** ceil(log10(gap_mm)), 10, 100 * high_mm # none beside the line's own
set ytics add (sprintf("<%.0e", floor_mm) bottom_mm)
set arrow 1 from graph 0, first gap_mm to graph 1, first gap_mm nohead lt 1 lw 1 dt 2 lc rgb grey

# The name of a series stands above its first point, or at its last one. Exact and fast may begin at
# one place: their names move apart.
first_name(text) = (int(column(0)) == 0 ? text : "")
last_name(text, n) = (int(column(0)) == n - 1 ? text : "")
above = "left rotate by 50 offset"
apart = exact_first_ns <= fast_first_ns ? 1 : -1

do for [panel = 1 : 2] {
    if (panel == 1) {
        set ylabel "largest error of the distance [mm]" textcolor rgb dark
        set xlabel "time of one query on a path, median [ns]" textcolor rgb dark
        set xrange [ns_low : ns_high]
        exact_name = "exact"
        fast_name = "fast"
        track_name = "track"
    } else {
        unset label
        unset ylabel
        set xlabel "memory [KB]" textcolor rgb dark
        set xrange [kb_low : kb_high]
        exact_name = "exact, fast, track"
        fast_name = ""
        track_name = ""
    }
    plot $front index panel - 1 using 1:2 with steps lw 9 lc rgb gold notitle, \
        $grid using panel:3 with linespoints ls 5 notitle, \
        $adf using panel:3 with linespoints ls 6 notitle, \
        $linear using panel:3 with points ls 4 notitle, \
        $hermite using panel:3 with points ls 4 notitle, \
        $track using panel:3 with linespoints ls 3 notitle, \
        $fast using panel:3 with linespoints ls 2 notitle, \
        $exact using panel:3 with linespoints ls 1 notitle, \
        $front index panel - 1 using 1:2 with points pt 6 ps 2 lw 1.6 lc rgb dark notitle, \
        $exact using panel:3:4 with labels left offset 0.9, 0 font small textcolor rgb blue notitle, \
        $grid using panel:3:4 with labels right offset -0.9, 0 font small textcolor rgb grey notitle, \
        $adf using panel:3:4 with labels left offset 0.9, 0 font small textcolor rgb grey notitle, \
        $exact using panel:3:(first_name(exact_name)) \
            with labels @above 0.2 - 0.9 * apart, 0.9 textcolor rgb blue notitle, \
        $fast using panel:3:(first_name(fast_name)) \
            with labels @above 0.2 + 0.9 * apart, 0.9 textcolor rgb blue notitle, \
        $track using panel:3:(first_name(track_name)) \
            with labels @above 0.2, 0.9 textcolor rgb blue notitle, \
        $hermite using panel:3:(last_name("map", n_hermite)) \
            with labels left offset 1, -0.1 textcolor rgb orange notitle, \
        $grid using panel:3:(last_name("uniform grid", n_grid)) \
            with labels center offset 0, -1.1 textcolor rgb grey notitle, \
        $adf using panel:3:(first_name("octree ADF")) \
            with labels @above 0.2, 0.9 textcolor rgb grey notitle
}
unset multiplot
