# SPDX-License-Identifier: BSD-3-Clause
"""The folder meshes/ through the real `shcd fit`: meshes/expected.txt tells the exit status and the
message for each file. And whatever the importer does, die, hang or eat memory, in the end there is
one clear line, no output, no process left, and no core file."""
import filecmp
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

SHCD = os.environ["SHCD"]
MESHES = os.environ["SHCD_BAD_MESHES"]
FAKE = os.environ["SHCD_FAKE_IMPORTER"]
SANITIZER = "verify_asan_link_order=0:allocator_may_return_null=1"
# Two files here hang the bare importer or make it take 1.8 GB and more. A refusal takes 0.01 s; the
# bounds leave room for sanitizers and a loaded machine.
PATIENCE_S = 60
MEMORY_KIB = 1 << 20


def expected():
    with open(os.path.join(MESHES, "expected.txt")) as file:
        for line in file:
            if line.strip() and not line.startswith("#"):
                name, status, text = (part.strip() for part in line.split("|", 2))
                yield name, int(status), text


def processor_time_s():
    """Of all child processes that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def allow_core_files():
    resource.setrlimit(resource.RLIMIT_CORE,
                       (resource.getrlimit(resource.RLIMIT_CORE)[1],) * 2)


class MeshTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)

    def path(self, name):
        return os.path.join(self.folder, name)

    def fit(self, mesh, *options, environment=None, patience_s=PATIENCE_S):
        """Runs it in the folder, which is also where a core file would be. The pipe ends when no
        process holds it any more."""
        alive, held = os.pipe()
        try:
            result = subprocess.run(
                [SHCD, "fit", mesh, "-o", self.path("body.shcd"), "--degree", "1", *options],
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                errors="replace", timeout=patience_s, cwd=self.folder, pass_fds=(held,),
                env=dict(os.environ, **(environment or {})), preexec_fn=allow_core_files)
        finally:
            os.close(held)
        os.set_blocking(alive, False)
        try:
            while os.read(alive, 65536):
                pass  # one of the fakes writes wherever it can
        except BlockingIOError:
            self.fail("a process was left behind")
        finally:
            os.close(alive)
        return result

    def refused(self, mesh, text, *options, status=1, **more):
        before = sorted(os.listdir(self.folder))
        result = self.fit(mesh, *options, **more)
        self.assertEqual(result.returncode, status, result)
        self.assertEqual(result.stdout, "")
        self.assertRegex(result.stderr, r"^shcd fit: [^\n]*\n$")
        self.assertIn(text, result.stderr)
        self.assertEqual(sorted(os.listdir(self.folder)), before)
        return result


class Folder(MeshTest):
    def test_each_file_as_expected(self):
        for name, status, text in expected():
            with self.subTest(name):
                mesh = os.path.join(MESHES, name)
                if status != 0:
                    result = self.refused(mesh, text, status=status)
                    self.assertIn("%s: " % name, result.stderr)
                else:
                    result = self.fit(mesh)
                    self.assertEqual(result.returncode, 0, result)
                    self.assertIn(text, result.stdout + result.stderr)
                    os.remove(self.path("body.shcd"))
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
        print("largest process so far: %.0f MiB" % (peak / 1024))
        self.assertLess(peak, MEMORY_KIB)

    def test_list_and_folder_agree(self):
        names = [name for name, _, _ in expected()]
        self.assertEqual(len(names), len(set(names)))
        there = {name for name in os.listdir(MESHES) if not name.endswith((".py", ".txt"))}
        self.assertEqual(there ^ set(names), set())

    def test_written_files_are_what_the_script_writes(self):
        subprocess.run([sys.executable, "-B", os.path.join(MESHES, "make_meshes.py"), self.folder],
                       check=True)
        written = os.listdir(self.folder)
        self.assertGreater(len(written), 100)
        for name in written:
            self.assertTrue(filecmp.cmp(self.path(name), os.path.join(MESHES, name), False), name)


class Importer(MeshTest):
    """In place of the importer, a library that does what no importer should (fake_importer.c)."""

    def misbehaves(self, how, text, *options, patience_s=PATIENCE_S):
        mesh = os.path.join(MESHES, "good.obj")
        return self.refused(mesh, text, *options, patience_s=patience_s, environment={
            "LD_PRELOAD": FAKE, "SHCD_FAKE_IMPORTER": how,
            "ASAN_OPTIONS": SANITIZER})

    def test_abort(self):
        self.misbehaves("abort", "good.obj: the import died of signal 6 (")

    def test_crash(self):
        self.misbehaves("crash", "good.obj: the import ")

    def test_exit(self):
        self.misbehaves("exit", "good.obj: the import ended with status 0 and no answer")

    def test_prints_nothing_of_its_own(self):
        self.misbehaves("print", "good.obj: the import died of signal 6 (")

    def test_endless_loop_meets_the_limit_of_processor_time(self):
        before_s = processor_time_s()
        result = self.misbehaves("loop", "it may take 1 s and 256 MiB", "--import-time", "1")
        # on a loaded machine the clock's limit may come first, but not for want of the other
        self.assertRegex(result.stderr, "good.obj: the import (takes too long|was given up after "
                         "4 s);")
        self.assertLess(processor_time_s() - before_s, 2.0)

    def test_endless_sleep_meets_the_limit_on_the_clock(self):
        self.misbehaves("sleep", "good.obj: the import was given up after 4 s", "--import-time",
                        "1")

    def test_memory_meets_its_limit(self):
        self.misbehaves("memory", "good.obj: out of memory; the import may take 100 MiB",
                        "--import-memory", "100")

    def test_default_memory_limit_grows_with_the_file(self):
        self.misbehaves("memory", "good.obj: out of memory; the import may take 256 MiB")
        with open(os.path.join(MESHES, "good.obj")) as file:
            text = file.read()
        with open(self.path("large.obj"), "w") as file:
            file.write(text + "#" * (1 << 20))
        self.refused(self.path("large.obj"), "out of memory; the import may take 320 MiB",
                     environment={"LD_PRELOAD": FAKE, "SHCD_FAKE_IMPORTER": "memory",
                                  "ASAN_OPTIONS": SANITIZER})

    def test_answers_of_a_hijacked_process_are_not_believed(self):
        self.misbehaves("zeros", "good.obj: the import ended with status 0 and no answer")
        self.misbehaves("noise", "shcd fit: ")

    def test_ends_with_its_parent(self):
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            alive, held = os.pipe()
            process = subprocess.Popen(
                [SHCD, "fit", os.path.join(MESHES, "good.obj"), "-o", self.path("body.shcd")],
                pass_fds=(held,), env=dict(os.environ, LD_PRELOAD=FAKE, SHCD_FAKE_IMPORTER="sleep",
                                           ASAN_OPTIONS=SANITIZER))
            os.close(held)
            time.sleep(0.5)
            process.send_signal(number)
            self.assertEqual(process.wait(PATIENCE_S), -number)
            self.assertEqual(os.read(alive, 1), b"")  # returns when the importer is gone
            os.close(alive)
            self.assertEqual(os.listdir(self.folder), [])

    def test_limits_must_make_sense(self):
        mesh = os.path.join(MESHES, "good.obj")
        for option in ("--import-memory", "--import-time"):
            for value in ("0", "-1", "1.5", "many", "16777217"):
                self.refused(mesh, "%s %s: must be 1 to 16777216" % (option, value), option, value,
                             status=2)

    def test_a_pipe_that_says_nothing(self):
        os.mkfifo(self.path("pipe.obj"))
        self.refused(self.path("pipe.obj"), "pipe.obj: the import was given up after 4 s",
                     "--import-time", "1")


class Rounding(MeshTest):
    def report(self, mesh, *options):
        result = self.fit(mesh, "--json", "-", *options)
        self.assertEqual(result.returncode, 0, result)
        return json.loads(result.stdout)["mesh"], result.stderr

    def test_is_stated(self):
        mesh, complaints = self.report(os.path.join(MESHES, "good.obj"))
        self.assertEqual(mesh["import_rounding_m"], 2.0 ** -24)
        percent = 100.0 * 2.0 ** -24 / 3.0 ** 0.5
        self.assertLess(abs(mesh["import_rounding_percent_of_diagonal"] / percent - 1.0), 1e-12)
        self.assertNotIn("single precision", complaints)
        result = self.fit(os.path.join(MESHES, "good.obj"))
        self.assertRegex(result.stdout, "import rounding +5.96046e-08 m .*% of the diagonal")

    def test_far_from_the_origin_brings_a_warning(self):
        mesh, complaints = self.report(os.path.join(MESHES, "far.obj"))
        self.assertEqual(mesh["import_rounding_m"], 30001.0 * 2.0 ** -24)
        self.assertIn("of the diagonal: move the mesh closer to its origin", complaints)

    def test_unit_does_not_matter(self):
        mesh, complaints = self.report(os.path.join(MESHES, "far.obj"), "--unit", "mm")
        self.assertLess(abs(mesh["import_rounding_m"] / (30.001 * 2.0 ** -24) - 1.0), 1e-12)
        self.assertIn("single precision", complaints)

    def test_tolerance_below_it_brings_a_warning(self):
        result = subprocess.run(
            [SHCD, "fit", os.path.join(MESHES, "good.obj"), "-o", self.path("body.shcd"),
             "--tolerance", "1e-8", "--degree-max", "1"], stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, text=True)
        self.assertEqual(result.returncode, 1)
        self.assertIn("rounds coordinates by about 5.96e-08 m, more than the tolerance of 1e-08 m",
                      result.stderr)


if __name__ == "__main__":
    unittest.main()
