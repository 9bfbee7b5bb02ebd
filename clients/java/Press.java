/* SPDX-License-Identifier: BSD-3-Clause */
import java.io.IOException;
import java.io.PrintWriter;
import java.nio.file.Files;
import java.nio.file.Path;
import java.util.ArrayList;
import java.util.HashMap;
import java.util.List;
import java.util.Locale;
import java.util.Map;
import java.util.concurrent.LinkedBlockingQueue;
import java.util.concurrent.TimeUnit;
import java.util.stream.IntStream;
import lcm.lcm.LCM;
import lcm.lcm.LCMDataInputStream;
import lcm.lcm.LCMSubscriber;
import shcdmsg.tool_force_t;
import shcdmsg.tool_pose_t;

/**
 * A complete client of shcdd: a tool approaches a body, presses, slides, holds and leaves.
 *
 * <p>The same path and the same rules as clients/c/press.c: one pose a period on an absolute clock,
 * no waiting for answers, answers matched by tool_seq, latency on our own clock only. LCM calls us
 * from a thread of its own; that thread only decodes, notes the time and hands over, and everything
 * else happens in the main thread.
 */
public final class Press implements LCMSubscriber {
    private static final int REMEMBERED = 4096; // poses; an answer to an older one is ignored

    private record Option(String name, String help, double[] value, double min, double max) {}

    private record Sent(long utime, double[] position) {}

    private record Arrival(tool_force_t force, long utime) {}

    /** tripS: NaN for a repeated answer (the daemon had no newer pose for that tick). */
    private record Answer(tool_force_t force, double[] position, double tripS) {}

    private static final double[] tool = {0}, radius = {0}, depth = {0.003}, speed = {0.02};
    private static final double[] hold = {1}, rate = {1000};
    private static final double[] from = {-0.015, 0, 0.06}, to = {0.015, 0, 0.06};
    private static String csvPath;
    private static final List<Option> OPTIONS = List.of(
        new Option("--tool", "id of the tool in the scene", tool, 0, 255),
        new Option("--radius", "its radius in the scene, 0 for a point [m]", radius, 0, 1),
        new Option("--from", "x,y,z to start at, outside the body, world [m]", from, -10, 10),
        new Option("--to", "x,y,z to end at, likewise", to, -10, 10),
        new Option("--depth", "how deep to press at both ends of the slide [m]", depth, 0, 1),
        new Option("--speed", "mean speed of each leg [m/s]", speed, 1e-4, 1),
        new Option("--hold", "how long to hold still before leaving [s]", hold, 0, 3600),
        new Option("--rate", "poses in a second [Hz]", rate, 10, 10000));

    private final LCM lcm;
    private final LinkedBlockingQueue<Arrival> arrived = new LinkedBlockingQueue<>();
    private volatile long nMalformed; // written by one thread
    private final Map<Long, Sent> sent = new HashMap<>(); // by seq
    private final List<Answer> answers = new ArrayList<>();
    private long seq, nLate; // last pose sent; points of the time grid that were missed
    private long deadlineNs = System.nanoTime();

    private Press(LCM lcm) {
        this.lcm = lcm;
        lcm.subscribe("SHCD_FORCE", this);
    }

    /** In LCM's thread, which would end with anything thrown here, and this program go deaf. */
    @Override
    public void messageReceived(LCM node, String channel, LCMDataInputStream in) {
        final long nowUs = System.nanoTime() / 1000;
        try {
            arrived.add(new Arrival(new tool_force_t(in), nowUs));
        } catch (Throwable e) { // not only IOException: bad counts throw unchecked ones
            nMalformed++;
        }
    }

    private void take(Arrival a) {
        final tool_force_t m = a.force();
        final Sent pose = sent.get(m.tool_seq);
        final long newest = answers.isEmpty() ? 0 : last().tool_seq;
        if (m.tool_id != (int) tool[0] || pose == null || m.tool_utime != pose.utime()
            || m.tool_seq < newest) {
            return; // for another tool or client, or overtaken by a newer answer
        }
        final double tripS = m.tool_seq > newest ? 1e-6 * (a.utime() - pose.utime()) : Double.NaN;
        answers.add(new Answer(m, pose.position(), tripS));
    }

    private tool_force_t last() {
        return answers.get(answers.size() - 1).force();
    }

    /** Sends a pose, then takes forces until the next point of the time grid, and any waiting. */
    private void tick(double[] position, double[] velocity) throws InterruptedException {
        final tool_pose_t pose = new tool_pose_t();
        pose.utime = System.nanoTime() / 1000;
        pose.seq = ++seq;
        pose.tool_id = (int) tool[0];
        pose.flags = tool_pose_t.HAS_VEL | tool_pose_t.FORCE_ENABLE;
        pose.pos = position;
        pose.vel = velocity;
        sent.put(seq, new Sent(pose.utime, position));
        sent.remove(seq - REMEMBERED);
        lcm.publish("SHCD_TOOL", pose);

        final long periodNs = (long) (1e9 / rate[0]);
        final long missed = (System.nanoTime() - deadlineNs) / periodNs;
        nLate += missed; // skip them, do not catch up
        deadlineNs += (missed + 1) * periodNs;
        Arrival a;
        while ((a = arrived.poll(deadlineNs - System.nanoTime(), TimeUnit.NANOSECONDS)) != null) {
            take(a);
        }
    }

    /** Moves straight from a to b with a smooth start and end (minimum jerk); a = b holds still. */
    private void move(double[] a, double[] b, double timeS) throws InterruptedException {
        final double[] ab = sum(b, -1.0, a);
        final double durationS = Math.max(timeS, norm(ab) / speed[0]) + 1e-3;
        final long startNs = deadlineNs;
        double s = 0.0, lastS = 0.0;
        while (lastS < 1.0) {
            final double part = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
            final double perS = 30.0 * s * s * (1.0 - s) * (1.0 - s) / durationS;
            tick(sum(a, part, ab), sum(new double[3], perS, ab));
            lastS = s;
            s = Math.min(1.0, 1e-9 * (deadlineNs - startNs) / durationS);
        }
    }

    /**
     * Rests at a point until the daemon has answered, then says where to be to press below it.
     * Answers without a body come from a daemon that takes the pose for stale.
     */
    private double[] ask(double[] point) throws InterruptedException {
        final long asked = seq, giveUpNs = System.nanoTime() + 10_000_000_000L;
        while (answers.isEmpty() || last().tool_seq <= asked || last().body_id < 0) {
            if (System.nanoTime() > giveUpNs) {
                die(1, "no answer in 10 s: does shcdd run here, with this tool and a body in its "
                    + "scene?");
            }
            tick(point, new double[3]);
        }
        if (last().penetration > 0.0) {
            die(1, "the path does not begin and end outside the body");
        }
        return sum(last().proxy, radius[0] - depth[0], last().normal);
    }

    private void report(tool_force_t held, long startNs) {
        final double[] trips = answers.stream().mapToDouble(Answer::tripS)
            .filter(trip -> !Double.isNaN(trip)).map(trip -> 1e3 * trip).sorted().toArray();
        final tool_force_t first = answers.get(0).force(), end = last();
        double contactS = 0.0, peakN = 0.0, peakM = 0.0, beforeUs = first.utime;
        long nLimited = 0;
        for (Answer a : answers) {
            final tool_force_t m = a.force();
            contactS += m.penetration > 0.0 ? 1e-6 * (m.utime - beforeUs) : 0.0;
            nLimited += (m.flags & (tool_force_t.LIMITED | tool_force_t.SLEW)) != 0 ? 1 : 0;
            peakN = Math.max(peakN, norm(m.force));
            peakM = Math.max(peakM, m.penetration);
            beforeUs = m.utime;
        }
        print("poses       %d sent at %.1f Hz (%d late), %.2f %% answered", seq,
            1e9 * seq / (System.nanoTime() - startNs), nLate,
            100.0 * trips.length / (seq - first.tool_seq + 1));
        print("daemon      %.1f ticks/s, %d of them with a limited force",
            1e6 * (end.tick - first.tick) / (end.utime - first.utime), nLimited);
        print("round trip  p50 %.3f, p99 %.3f, p99.9 %.3f, max %.3f ms", at(trips, 0.5),
            at(trips, 0.99), at(trips, 0.999), at(trips, 1.0));
        print("contact     %.3f s, at most %.4f N and %.4f mm deep", contactS, peakN, 1e3 * peakM);
        print("held        %.9f N at a depth of %.9f mm", norm(held.force), 1e3 * held.penetration);
        if (nMalformed > 0) {
            System.err.println("press: " + nMalformed + " messages on SHCD_FORCE were no forces");
        }
    }

    private void writeCsv() {
        final long firstUs = answers.get(0).force().utime;
        try (PrintWriter csv = new PrintWriter(Files.newBufferedWriter(Path.of(csvPath)))) {
            csv.print("time_s,tick,seq,x_m,y_m,z_m,fx_n,fy_n,fz_n,penetration_m,distance_m,rtt_s,"
                + "flags\n");
            for (Answer a : answers) {
                final tool_force_t m = a.force();
                final double[] p = a.position(), f = m.force;
                // signed, from the surface to the middle of the tool
                final double distance = dot(sum(p, -1.0, m.proxy), m.normal);
                csv.printf(Locale.ROOT, "%.6f,%d,%d,", 1e-6 * (m.utime - firstUs), m.tick,
                    m.tool_seq);
                csv.print(p[0] + "," + p[1] + "," + p[2] + "," + f[0] + "," + f[1] + "," + f[2]);
                csv.print("," + m.penetration + "," + distance);
                csv.printf(Locale.ROOT, ",%.6f,%d\n", a.tripS(), m.flags);
            }
            if (csv.checkError()) { // a PrintWriter keeps its exceptions to itself
                die(1, "cannot write " + csvPath);
            }
        } catch (IOException e) {
            die(1, "cannot write " + csvPath + ": " + e);
        }
    }

    private static double dot(double[] a, double[] b) {
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    }

    private static double norm(double[] a) {
        return Math.sqrt(dot(a, a));
    }

    /** a + s b */
    private static double[] sum(double[] a, double s, double[] b) {
        return IntStream.range(0, 3).mapToDouble(i -> a[i] + s * b[i]).toArray();
    }

    /** The value below which a part of them is. */
    private static double at(double[] sorted, double part) {
        return sorted[(int) (part * (sorted.length - 1))];
    }

    private static void print(String format, Object... values) {
        System.out.print(String.format(Locale.ROOT, format, values) + "\n");
    }

    private static void die(int status, String text) {
        System.err.println("press: " + text);
        System.exit(status);
    }

    private static void readValue(Option option, String text) {
        final String[] parts = text.split(",", -1);
        boolean good = parts.length == option.value().length;
        for (int k = 0; good && k < parts.length; k++) {
            try {
                option.value()[k] = Double.parseDouble(parts[k]);
            } catch (NumberFormatException e) {
                good = false;
            }
            good &= option.value()[k] >= option.min() && option.value()[k] <= option.max();
        }
        if (!good) {
            die(2, "not a value for " + option.name() + ", or out of range: " + text);
        }
    }

    private static void readOptions(String[] words) {
        for (int i = 0; i < words.length; i += 2) {
            final String name = words[i];
            if (name.equals("--help")) {
                OPTIONS.forEach(o -> print("%-8s %s", o.name(), o.help()));
                print("%-8s %s", "--csv", "file for all answers");
                System.exit(0);
            }
            if (i + 1 == words.length) {
                die(2, "an option without a value, or an unknown one (see --help): " + name);
            }
            if (name.equals("--csv")) {
                csvPath = words[i + 1];
                continue;
            }
            final Option option =
                OPTIONS.stream().filter(o -> o.name().equals(name)).findFirst().orElse(null);
            if (option == null) {
                die(2, "unknown option (see --help): " + name);
            }
            readValue(option, words[i + 1]);
        }
    }

    public static void main(String[] words) throws InterruptedException {
        readOptions(words);
        Press press = null;
        try {
            press = new Press(new LCM());
        } catch (IOException e) {
            die(1, "no LCM (" + e + "): is there a multicast route on the loopback device?");
        }
        final long startNs = System.nanoTime();
        final double[] pressedTo = press.ask(to), pressedFrom = press.ask(from);
        press.move(from, pressedFrom, 0.0);
        press.move(pressedFrom, pressedTo, 0.0);
        press.move(pressedTo, pressedTo, hold[0]);
        final tool_force_t held = press.last();
        press.move(pressedTo, to, 0.0);
        press.lcm.close();
        press.report(held, startNs);
        if (csvPath != null) {
            press.writeCsv();
        }
        System.exit(0); // LCM's thread need not have ended
    }
}
