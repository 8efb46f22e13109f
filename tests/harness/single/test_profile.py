"""Profiles of programs whose functions take known shares of a frame."""

import json
import re

import pytest
from compilers import compiler
from pages import blocks

from harness.single import callgrind, profile
from rayrace.profile import speedscope

SCENE = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)\nBACKGROUND (0.2,0.5,0.7)\n"
C = """
static void spin(long turns) { for (long k = 0; k < turns; k++) __asm__ volatile(""); }
static inline __attribute__((always_inline)) void three_parts(void) { spin(3000000); }
static __attribute__((noinline)) void one_part(void) { spin(1000000); }
"""
PYTHON = """
def three_parts():
    for _ in range(600_000): pass


def one_part():
    for _ in range(200_000): pass


"""


@pytest.fixture
def ask(tmp_path, rayrace):
    """Profiles a renderer of the page on adding one, with work put into its frames; JSON."""

    def ask(language, file, before, after, code, *more):
        if language == "c":
            compiler("c")
        manifest = blocks("adding-a-renderer.md", "toml")[["python", "c"].index(language)]
        (program,) = blocks("adding-a-renderer.md", language)
        assert program.count(before) == 1
        mine = tmp_path / "mine"
        mine.mkdir(exist_ok=True)
        (mine / "renderer.toml").write_text(re.sub(r'"flat(-c)?"', '"mine"', manifest))
        head, tail = program.split(before)
        place = head.rindex("static double now") if language == "c" else head.index("camera, background = read")
        (mine / file).write_text(head[:place] + code + head[place:] + after + tail)
        (tmp_path / "scene.txt").write_text(SCENE)
        small = "--width", 8, "--height", 6, "--no-shadows", "--depth", 0
        done = rayrace("profile", tmp_path / "scene.txt", "-r", "mine", "--renderer", mine, *small, "--json", *more)
        lacks = "Permission", "not permitted", "not installed", "no program valgrind"
        if any(why in done.stderr for why in lacks):
            pytest.skip(done.stderr)
        assert done.returncode == 0, done.stderr
        found = json.loads(done.stdout)
        return found, {one["name"]: one for one in found["functions"]}

    return ask


@pytest.mark.slow
def test_a_program_in_c(ask, tmp_path):
    """Of functions that are inlined too; start-up and what writes the picture are no part of a frame."""
    begin = "double begin = now();"
    told, functions = ask("c", "flat.c", begin, f"{begin} three_parts(), one_part();", C, "-o", tmp_path / "a.json")
    assert told["tool"].startswith("callgrind") and told["unit"] == "instructions" and told["size"] is None
    shares = {name: functions[name]["whole"] / told["total"] for name in ("three_parts", "one_part", "spin", "main")}
    assert shares["three_parts"] == pytest.approx(0.75, abs=0.02) and shares["one_part"] == pytest.approx(
        0.25, abs=0.02
    )
    assert shares["spin"] > 0.97 and shares["main"] > 0.97
    assert sum(one["own"] for one in told["functions"]) == pytest.approx(told["total"])
    assert not {"read_end", "fopen"} & set(functions)
    file = json.loads((tmp_path / "a.json").read_text())
    (shown,) = file["profiles"]
    assert sum(shown["weights"]) == pytest.approx(told["total"]) and shown["endValue"] == pytest.approx(told["total"])
    names = [[file["shared"]["frames"][number]["name"] for number in stack] for stack in shown["samples"]]
    assert any(stack[-3:] == ["main", "three_parts", "spin"] for stack in names)


@pytest.mark.alone
def test_a_program_in_python(ask, tmp_path):
    work = "pixels = background * ((x1 - x0) * (y1 - y0))"
    after = f"three_parts(); one_part(); {work}"
    told, functions = ask("python", "flat.py", work, after, PYTHON, "-o", tmp_path / "a.svg")
    assert told["tool"].startswith("py-spy") and told["unit"] == "seconds"
    named = {name.partition(" (")[0]: one["own"] for name, one in functions.items()}
    assert named["three_parts"] / (named["three_parts"] + named["one_part"]) == pytest.approx(0.75, abs=0.1)
    assert named["three_parts"] / told["total"] > 0.6
    assert "three_parts" in (tmp_path / "a.svg").read_text()


def test_functions_count_a_recursion_once():
    stacks = {("main", "walk", "walk", "hit"): 6.0, ("main", "walk"): 3.0, ("main",): 1.0}
    found = {name: (own, whole) for name, own, whole in profile.Profile("t", "instructions", stacks).functions()}
    assert found == {"main": (1.0, 10.0), "walk": (3.0, 9.0), "hit": (6.0, 6.0)}
    shown = speedscope(profile.Profile("t", "instructions", stacks), "title")["profiles"][0]
    assert shown["samples"] == [[0, 1, 1, 2], [0, 1], [0]] and shown["unit"] == "none"


@pytest.mark.parametrize(
    "name, wanted",
    [
        ("main", "main"),
        ("void render<double, Box<float> >(Scene const&, int)", "render"),
        ("Vec3<double> operator-<double>(Vec3<double> const&)", "operator-"),
        ("std::vector<int, std::allocator<int> >::push_back(int&&)", "std::vector::push_back"),
        ("(anonymous namespace)::spin(long)", "spin"),
        ("0x0000000000012340", "0x0000000000012340"),
        ("std::ostream& operator<< <char>(std::ostream&, char)", "operator<<"),
        ("bool operator<(A const&, B)", "operator<"),
        ("A<B>::operator->() const", "A::operator->"),
        ("operator new(unsigned long)", "operator new"),
        ("Foo::operator bool() const", "Foo::operator bool"),
        ("operator_like(int)", "operator_like"),
        ("Walker<double>::chain(Branch<double>, Desk<double>&) const", "Walker::chain"),
        ("Picture<double> render<double, with<A> >(Job const&)", "render"),
        (
            "Sampler<double>::render(int) const::{lambda(int)#1}::operator()(int) const",
            "Sampler::render::lambda::operator()",
        ),
        ("std::string::insert(unsigned long, char const*) [clone .constprop.0]", "std::string::insert"),
        ("pow@@GLIBC_2.29", "pow"),
        ("(below main)", "(below main)"),
    ],
)
def test_names_are_short(name, wanted):
    assert callgrind.short(name) == wanted


def test_what_callgrind_writes(tmp_path):
    """Costs of a call are those of the function that was called, and no second time the caller's."""
    (tmp_path / "1.callgrind").write_text(
        "version: 1\npositions: instr line\nevents: Ir\n\nob=/none/prog\nfl=a.c\nfn=main\n0x10 1 5\n"
        "cfn=spin'main\ncalls=2 0x40 7\n0x14 2 900\n0x18 3 1\n\nfn=spin'main\n0x40 7 890\nfi=b.h\n0x44 9 10\n"
    )
    costs = callgrind.read(tmp_path)
    assert costs == {
        ("/none/prog", "main", 0x10): 5, ("/none/prog", "main", 0x18): 1,
        ("/none/prog", "spin'main", 0x40): 890, ("/none/prog", "spin'main", 0x44): 10,
    }  # fmt: skip
    assert callgrind.stacks(costs) == {("main",): 6, ("main", "spin"): 900}


def test_samples_of_py_spy():
    text = "a (x.py:1);b (y.py:2) 3\na (x.py:1) 4\n\nnothing\na (x.py:1);b (y.py:2) 1\n"
    assert profile.collapsed(text) == {("a (x.py:1)", "b (y.py:2)"): 4, ("a (x.py:1)",): 4}


def test_stacks_that_callgrind_cuts_begin_where_the_others_do():
    """Of a recursion with more callers than callgrind names; a function without a name is called by its file."""
    costs = {
        ("/none/a.out", "main'(below main)", 1): 1,
        ("/none/a.out", "render'main'(below main)", 2): 2,
        ("/none/a.out", "trace'render'main'(below main)", 3): 4,
        ("/none/a.out", "trace'trace'trace'trace'trace'trace'trace", 4): 8,
        ("/none/libm.so.6", "0x000abc'trace'trace'trace'trace'trace'trace", 5): 16,
    }
    stacks = callgrind.stacks(costs)
    assert {stack[:3] for stack in stacks if len(stack) > 2} == {("main", "render", "trace")}
    assert stacks["main", "render", *["trace"] * 7] == 8 and stacks["main", "render", *["trace"] * 6, "libm.so.6"] == 16
    assert stacks["main",] == 1 and sum(stacks.values()) == 31
