# SPDX-License-Identifier: BSD-3-Clause
# The region of stability, from the table that `region` prints:
#     gnuplot -e "table='docs/stability-region.txt'; plot_file='docs/stability-region.svg'" region.gp
set terminal svg size 720,480 font "sans,13" background "white"
set output plot_file
set logscale xy
set xlabel "stiffness k [N/m]"
set ylabel "damping b of device and hand [N s/m]"
set key left top
set grid
set xrange [10:20000]
set title "Stable above the curves: lines b = k (T/2 + delay), points measured (T = 1 ms)"
array delay[4] = ["0 ms", "0.5 ms", "1 ms", "2 ms"]
plot for [i=0:3] table index i using 2:3 with lines lw 1.5 lc (i+1) title delay[i+1], \
     for [i=0:3] table index i using 2:4 with points pt 7 ps 0.6 lc (i+1) notitle
