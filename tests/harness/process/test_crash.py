"""The reason that a program gives for its death is found, in many languages and in any text."""

import shutil
import subprocess
import time

import pytest

from harness.process import crash
from harness.renderer import builder

# As the programs print them; what they are of is in the key.
TEXTS = {
    "rust": (
        "\nthread 'main' (18892) panicked at src/main.rs:3:5:\nindex out of bounds: the len is 1 but the index is 5\n"
        "note: run with `RUST_BACKTRACE=1` environment variable to display a backtrace\n",
        "panicked at src/main.rs:3:5:\nindex out of bounds: the len is 1 but the index is 5",
    ),
    "rust of old": (
        "thread 'main' panicked at 'no room', src/main.rs:2:5\nnote: run with `RUST_BACKTRACE=1`\n",
        "panicked at 'no room', src/main.rs:2:5",
    ),
    "rust, two threads, with a backtrace": (
        "loading\nthread '<unnamed>' panicked at b.rs:2:39:\ntwo\nlines\nstack backtrace:\n   0: std::panicking\n"
        "\nthread 'main' panicked at b.rs:2:74:\ncalled `Result::unwrap()` on an `Err` value: Any { .. }\n",
        "panicked at b.rs:2:39:\ntwo\nlines",
    ),
    "go": (
        "panic: runtime error: index out of range [5] with length 3\n\ngoroutine 1 [running]:\nmain.main()\n"
        "\t/tmp/main.go:5 +0x1d\nexit status 2\n",
        "panic: runtime error: index out of range [5] with length 3",
    ),
    "go, a signal": (
        "panic: runtime error: invalid memory address or nil pointer dereference\n[signal SIGSEGV: segmentation "
        "violation code=0x1 addr=0x0 pc=0x48]\n\ngoroutine 1 [running]:\nmain.main()\n",
        "panic: runtime error: invalid memory address or nil pointer dereference",
    ),
    "go, a deadlock": (
        "fatal error: all goroutines are asleep - deadlock!\n\ngoroutine 1 [chan receive]:\nmain.main()\n\tmain.go:5\n",
        "fatal error: all goroutines are asleep - deadlock!",
    ),
    "c++": (
        "terminate called after throwing an instance of 'std::runtime_error'\n  what():  no room\nAborted\n",
        "terminate called after throwing an instance of 'std::runtime_error'\n  what():  no room",
    ),
    "c++, no message": (
        "terminate called after throwing an instance of 'int'\nAborted\n",
        "terminate called after throwing an instance of 'int'",
    ),
    "assert": (
        "main: main.c:3: main: Assertion `count == 7' failed.\nAborted (core dumped)\n",
        "main: main.c:3: main: Assertion `count == 7' failed.",
    ),
    "address sanitizer": (
        "=====\n==98==ERROR: AddressSanitizer: heap-buffer-overflow on address 0x60\nWRITE of size 4\n    #0 0x5 in"
        " main\nSUMMARY: AddressSanitizer: heap-buffer-overflow d.c:2 in main\nShadow bytes\n==98==ABORTING\n",
        "==98==ERROR: AddressSanitizer: heap-buffer-overflow on address 0x60",
    ),
    "undefined behaviour": (
        "a.c:1:60: runtime error: index 5 out of bounds for type 'int [2]'\n    #0 0x5 in main a.c:1\n",
        "a.c:1:60: runtime error: index 5 out of bounds for type 'int [2]'",
    ),
    "java": (
        'Exception in thread "main" java.lang.IllegalStateException: cannot render\n\tat A.main(A.java:1)\n'
        "Caused by: java.lang.ArrayIndexOutOfBoundsException: Index 3\n\tat A.main(A.java:1)\n\t... 8 more\n",
        "java.lang.IllegalStateException: cannot render",
    ),
    "c#": (
        "Unhandled exception. System.IndexOutOfRangeException: Index was outside.\n   at A.Main() in A.cs:line 4\n",
        "System.IndexOutOfRangeException: Index was outside.",
    ),
    "javascript": (
        "/tmp/n.js:1\nthrow new TypeError('x')\n^\n\nTypeError: no sphere\n    at f (/tmp/n.js:1:21)\n\nNode.js v20\n",
        "TypeError: no sphere",
    ),
    "zig": ("thread 12 panic: index out of bounds\n/tmp/a.zig:3:5: 0x1 in main (a)\n", "panic: index out of bounds"),
    "fortran": (
        "At line 5 of file x.f90\nFortran runtime error: Index '5' of dimension 1 above upper bound of 3\n\n"
        "Error termination. Backtrace:\n#0  0x7f in ???\n",
        "Fortran runtime error: Index '5' of dimension 1 above upper bound of 3",
    ),
    "fortran, error stop": ("ERROR STOP no scene\n\nError termination. Backtrace:\n#0  0x7f\n", "ERROR STOP no scene"),
    "julia": (
        "ERROR: LoadError: DomainError with -1.0\nStacktrace:\n [1] throw at ./math.jl:33\nin expression at a.jl:1\n",
        "LoadError: DomainError with -1.0",
    ),
    "haskell": (
        "main: no scene\nCallStack (from HasCallStack):\n  error, called at a.hs:1:8 in main:Main\n",
        "main: no scene",
    ),
    "ocaml": (
        'Fatal error: exception Failure("no scene")\nRaised at Stdlib.failwith\n',
        'Fatal error: exception Failure("no scene")',
    ),
    "lua": ("lua: a.lua:1: no scene\nstack traceback:\n\t[C]: in function 'error'\n", "lua: a.lua:1: no scene"),
    "python": (
        'Traceback (most recent call last):\n  File "a.py", line 2\n    1/0\n    ~^~\nZeroDivisionError: division\n\n'
        "During handling of the above exception, another exception occurred:\n\nTraceback (most recent call last):\n"
        '  File "a.py", line 4\nValueError: first line\nsecond line\n',
        "ValueError: first line\nsecond line",
    ),
    "words before": ("loading\nrendering\ncannot read spheres.npy\n", "cannot read spheres.npy"),
    "a word of go's elsewhere": ("panic: is a word\nno scene\n", "no scene"),
    "blank": (" \n \n", ""),
    "a traceback without an end": ("Traceback (most recent call last):\n  File\n", "File"),
}


@pytest.mark.parametrize("name", TEXTS)
def test_reason(name):
    text, reason = TEXTS[name]
    assert crash.reason(text) == reason
    assert crash.reason(text.strip()) == reason  # as a repetition keeps it


PROGRAMS = {
    "c++": (
        "main.cpp",
        '#include <stdexcept>\nint main() { throw std::runtime_error("no room"); }\n',
        "terminate called after throwing an instance of 'std::runtime_error'\n  what():  no room",
    ),
    "c": ("main.c", "#include <assert.h>\nint main(void) { assert(!main); }\n", "Assertion `!main' failed."),
    "rustc": ("main.rs", "fn main() { assert_eq!(1, std::env::args().count() + 1); }\n", "left: 1\n right: 2"),
}


@pytest.mark.parametrize("kind", PROGRAMS)
def test_a_program_as_it_is_built_here(kind, tmp_path):
    file, source, reason = PROGRAMS[kind]
    if (compiler := builder.find_compiler(kind)) is None:
        pytest.skip(builder.missing(kind))
    (tmp_path / file).write_text(source)
    subprocess.run([compiler, file, "-o", "program"], cwd=tmp_path, check=True, capture_output=True)
    done = subprocess.run([tmp_path / "program"], capture_output=True, text=True)
    assert done.returncode and crash.reason(done.stderr).endswith(reason)


@pytest.mark.skipif(not shutil.which("node"), reason="no node here")
def test_javascript_as_it_runs_here():
    done = subprocess.run(["node", "-e", "null.x"], capture_output=True, text=True)
    assert crash.reason(done.stderr).startswith("TypeError: Cannot read properties of null")


@pytest.mark.parametrize(
    "part",
    [
        *("a", "\n", " ", "'", "Traceback (most recent call last):\n", "thread 'x' panicked at ", "thread '", "\nat ",
          "Error: ", ": Assertion ", ": runtime error", "panic: \n", "panic: x\nx\n", "==1==", "\u2028", "\0",
          "E\n\tat",
          "thread 'a' panicked at\nb\n", "ERROR: x\n", "  what(): \n"),
    ],
)  # fmt: skip
def test_hostile_text_takes_no_time(part):
    """A text of 64 KiB, as much as is read, takes no more than a time that grows with its length."""
    text = (part * (2**16 // len(part)))[: 2**16]

    def seconds(text: str) -> float:
        start = time.process_time()
        assert crash.reason(text) in text
        return time.process_time() - start

    short, long = (min(seconds(text[: 2**power]) for _ in range(3)) for power in (12, 16))
    assert long < 16 * 8 * max(short, 1e-4)
