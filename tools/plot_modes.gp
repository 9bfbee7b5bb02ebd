# SPDX-License-Identifier: BSD-3-Clause
# Force of a held ball against the number of modes, from bench_modes:
#     gnuplot -c plot_modes.gp TABLE.txt OUT.svg
set encoding utf8
set terminal svg size 800, 480 dynamic enhanced font "DejaVu Sans,13" background "#ffffff"
set output ARG2
set border 3 lc rgb "#404040"
set tics nomirror
set grid xtics ytics back linetype 1 linewidth 1 linecolor rgb "#dcdcdc"
set logscale xy
set xlabel "modes"
set ylabel "force at 1 mm [N]"
set key top right opaque
plot ARG1 using 1:4 with lines lw 1.5 dt 2 lc rgb "#404040" title "half-space, 2 E* a d", \
     "" using 1:3 with linespoints lw 2 pt 7 ps 0.6 lc rgb "#c0392b" title "modes alone", \
     "" using 1:2 with linespoints lw 2 pt 7 ps 0.6 lc rgb "#2471a3" \
         title "modes and the residual compliance"
