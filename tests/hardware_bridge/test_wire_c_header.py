"""The C header against the codec in Python: same bytes, same refusals."""

import os
import random
import re
import shutil
import subprocess
import sys

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from wire_twin import KEY, frame, mutate, payloads, readings, spread, words

from hardware_bridge.decoders.relpos import RelposDecoder
from hardware_bridge.wire.c_header import HEADER, c_header
from hardware_bridge.wire.definition import MESSAGES
from hardware_bridge.wire.encoder import RelposEncoder

STRICT = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion"]
CAREFUL = ["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]


def test_the_copy_is_that_of_the_definition():
    text = HEADER.read_text()
    assert text == c_header(), "python -m hardware_bridge.wire.c_header --out " + str(HEADER)
    assert "@" not in text
    for message in MESSAGES:
        assert f"#define RELPOS_{message.name.upper()} {message.type}u" in text


def test_the_command_writes_it(tmp_path):
    command = [sys.executable, "-m", "hardware_bridge.wire.c_header"]
    out = tmp_path / "x.h"
    subprocess.run([*command, "--out", out], check=True)
    assert out.read_text() == c_header()
    assert subprocess.run(command, check=True, capture_output=True, text=True).stdout == c_header()
    gone = subprocess.run([*command, "--out", out / "no"], capture_output=True, text=True)
    assert gone.returncode == 2
    assert "--out" in gone.stderr


def printing():
    """Return C code that prints every number of a frame."""
    cases = []
    for message in MESSAGES:
        lines = [f"case {message.type}:"]
        at = f"f->of.{message.name}"
        if message.repeated:
            lines.append(f"for (unsigned r = 0; r < {at}.n; r++) {{")
            at += ".row[r]"
        for field in message.fields:
            for place in [f"[{k}]" for k in range(field.n)] if field.n > 1 else [""]:
                lines.append(f'printf(" %lld", (long long){at}.{field.name}{place});')
        cases.append("\n".join([*lines, "}" * message.repeated, "break;"]))
    return "\n".join(cases)


def program():
    """Return C code that decodes frames and prints one per line.

    Prints the decoded numbers and the bytes encoded again in hexadecimal; at the end the counts.
    """
    return f"""
#include <stdio.h>
#include <string.h>
#include "relpos_wire.h"

static void show(const relpos_frame *f) {{
    printf("%u %u %u %lu %lu %lu", (unsigned)f->type, (unsigned)f->mac, (unsigned)f->node,
           (unsigned long)f->boot, (unsigned long)f->sequence, (unsigned long)f->time);
    switch (f->type) {{
    {printing()}
    }}
}}

static relpos_receiver receiver;

int main(int argc, char **argv) {{
    uint8_t key[16], bytes[RELPOS_MOST_BYTES];
    const uint8_t *used = NULL;
    unsigned long counts[5] = {{0, 0, 0, 0, 0}};
    relpos_frame f;
    int c;
    if (argc > 1) {{
        for (unsigned k = 0; k < 16; k++) {{
            unsigned byte;
            if (sscanf(argv[1] + 2 * k, "%2x", &byte) != 1) return 2;
            key[k] = (uint8_t)byte;
        }}
        used = key;
    }}
    memset(&f, 0xA5, sizeof f);
    while ((c = getchar()) != EOF) {{
        int result = relpos_receive(&receiver, (uint8_t)c, used, &f);
        counts[result]++;
        if (result != RELPOS_OK) continue;
        show(&f);
        printf(" : ");
        size_t n = relpos_encode(&f, used, bytes);
        for (size_t k = 0; k < n; k++) printf("%02x", (unsigned)bytes[k]);
        printf("\\n");
    }}
    printf("%lu %lu %lu %lu\\n", counts[1], counts[2], counts[3], counts[4]);
    return 0;
}}
"""


def compile_c(folder, source, flags, *, compiler="cc", name="program.c"):
    if shutil.which(compiler) is None:
        if os.environ.get("CI"):
            pytest.fail(f"no C compiler: expected {compiler}")
        pytest.skip(f"no compiler {compiler} on this machine")
    path, out = folder / name, folder / "program"
    path.write_text(source)
    subprocess.run([compiler, *flags, f"-I{HEADER.parent}", str(path), "-o", str(out)], check=True)
    return out


@pytest.fixture(scope="module", params=["strict", "sanitized"])
def echo(request, tmp_path_factory):
    flags = [*STRICT, "-O2"] if request.param == "strict" else [*STRICT, *CAREFUL]
    path = compile_c(tmp_path_factory.mktemp("c"), program(), flags)

    def run(data, key=None):
        """Return numbers and bytes of every frame, and the counts."""
        command = [str(path)] + ([key.hex()] if key else [])
        # Leak detection is not needed, and fails where tracing is forbidden.
        environment = {**os.environ, "ASAN_OPTIONS": "detect_leaks=0"}
        done = subprocess.run(command, input=data, capture_output=True, env=environment)
        assert done.returncode == 0, done.stderr.decode()
        *lines, counts = done.stdout.decode().splitlines()
        frames = [line.split(" : ") for line in lines]
        numbers = [tuple(map(int, left.split())) for left, _ in frames]
        return numbers, [bytes.fromhex(b) for _, b in frames], tuple(map(int, counts.split()))

    return run


def same(data, key, echo):
    """Compare the decoders of C and Python; return readings and the bytes that C encodes again."""
    decoder = RelposDecoder(key)
    met = decoder.feed(data)
    _, back, counts = echo(data, key)
    own = decoder.counts
    assert (own.skipped, own.damaged) == counts[1:3]
    assert own.frames == counts[0]
    assert RelposDecoder(key).feed(b"".join(back)) == met
    return met, b"".join(back)


SOME = settings(max_examples=25, suppress_health_check=[HealthCheck.too_slow])


@SOME
@given(spoken=st.lists(readings, max_size=20), boot=words, key=st.sampled_from([None, KEY]))
def test_what_python_says_is_understood(echo, spoken, boot, key):
    data = RelposEncoder(9, boot, key).encode(spoken)
    assert same(data, key, echo)[1] == data


@SOME
@given(spoken=st.lists(payloads(), max_size=20), time=words, key=st.sampled_from([None, KEY]))
def test_any_numbers_come_through(echo, spoken, time, key):
    frames = [frame(m.type, 65535, 1, k, time, p, key) for k, (m, p) in enumerate(spoken)]
    numbers, back, counts = echo(b"".join(frames), key)
    assert back == frames
    assert counts == (len(frames), 0, 0, 0)
    for k, ((message, data), met) in enumerate(zip(spoken, numbers, strict=True)):
        assert met[:6] == (message.type, key is not None, 65535, 1, k, time)
        places = [field for field in message.fields for _ in range(field.n)]
        rows = data[1:] if message.repeated else data
        expected = []
        while rows:
            for field in places:
                signed = field.type[0] == "i"
                expected.append(int.from_bytes(rows[: field.size], "little", signed=signed))
                rows = rows[field.size :]
        assert list(met[6:]) == expected


@pytest.mark.parametrize("key", [None, KEY])
def test_both_refuse_the_same(echo, key):
    rng = random.Random(5)
    frames = spread(11, 400, key)
    data = b"".join(mutate(rng, f) if rng.random() < 0.5 else f for f in frames)
    met, _ = same(data, key, echo)
    assert len(met) > 100
    for other in (
        spread(12, 50),
        spread(12, 50, KEY[::-1]),
        [b"\1" * 600 + b"\0", rng.randbytes(5000)],
    ):
        same(b"".join(other), key, echo)
    other = b"".join(
        frame(t, 1, 2, 3, 4, bytes(n), key, form)
        for t in (1, 4, 9, 255)
        for n in (0, 1, 18, 480)
        for form in (None, 0x22, 0x1F)
    )
    same(other, key, echo)


def test_frames_of_a_key_are_read_without_it(echo):
    data = b"".join(spread(4, 30, KEY))
    numbers, _, counts = echo(data)
    assert counts == (30, 0, 0, 0)
    assert all(met[1] == 1 for met in numbers)


SCALES = """
#include <stdio.h>
#include "relpos_wire.h"

int main(void) {
    relpos_imu imu = {{0, 0, 0}, {0, 0, 0}};
    relpos_ranges_row row = {0, 0, 0, 0, 0, 0, 0};
    relpos_frame f;
    uint8_t bytes[RELPOS_MOST_BYTES];
    float huge = 3e38f, infinite = huge * 10.0f;
    printf("%d ", relpos_imu_set_gyr(&imu, 0, 1.25f));
    printf("%d ", relpos_imu_set_gyr(&imu, 1, -1000.0f));
    printf("%d ", relpos_imu_set_gyr(&imu, 2, -0.000014f));
    printf("%d %d ", relpos_imu_set_gyr(&imu, 2, infinite), relpos_imu_set_acc(&imu, 0, -infinite));
    printf("%d ", relpos_imu_set_acc(&imu, 1, infinite - infinite));
    printf("%d %d ", relpos_imu_set_acc(&imu, 2, huge), relpos_ranges_row_set_distance(&row, 1e9f));
    printf("%d ", relpos_ranges_row_set_rx_power(&row, -81.239f));
    printf("%d ", relpos_ranges_row_set_quality(&row, 2.0f));
    printf("%ld %ld %ld ", (long)imu.gyr[0], (long)imu.gyr[1], (long)imu.gyr[2]);
    printf("%ld %ld %ld ", (long)imu.acc[0], (long)imu.acc[1], (long)imu.acc[2]);
    printf("%ld %d %d ", (long)row.distance, (int)row.rx_power, (int)row.quality);
    printf("%.5f %.2f ", (double)relpos_imu_gyr(&imu, 0), (double)relpos_ranges_row_rx_power(&row));
    f.type = RELPOS_RANGES;
    f.of.ranges.n = RELPOS_MOST_ROWS + 1;
    printf("%lu ", (unsigned long)relpos_encode(&f, NULL, bytes));
    f.type = 99;
    printf("%lu\\n", (unsigned long)relpos_encode(&f, NULL, bytes));
    return 0;
}
"""


def test_values_are_scaled_and_held_within_the_numbers(tmp_path):
    path = compile_c(tmp_path, SCALES, [*STRICT, *CAREFUL])
    done = subprocess.run([str(path)], capture_output=True, text=True,
                          env={**os.environ, "ASAN_OPTIONS": "detect_leaks=0"})  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [
        "1", "1", "1", "0", "0", "0", "1", "1", "1", "1",
        "125000", "-8388608", "-1", "0", "0", "8388607",
        "2147483647", "-8124", "255", "1.25000", "-81.24", "0", "0",
    ]  # fmt: skip


FIRMWARE = """
static const uint8_t *key;
static uint16_t my_node;
static uint32_t boot, sequence;
int is_new(uint32_t boot, uint32_t sequence);
void stop(void);
void drive(float speed, float steering);
uint32_t micros(void);
void write(const uint8_t *bytes, size_t n);
void byte_came(uint8_t byte);
void imu_came(const float gyr[3], const float acc[3]);
"""


def test_the_firmware_of_the_page_compiles(tmp_path):
    page = (HEADER.parents[2] / "docs" / "reference" / "wire-format.md").read_text()
    (code,) = re.findall(r"^```c\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    include, _, rest = code.partition("\n")
    compile_c(tmp_path, f"{include}{FIRMWARE}{rest}", [*STRICT, "-c"])


def test_it_is_cpp_too(tmp_path):
    source = (
        '#include "relpos_wire.h"\nint main() { relpos_frame f = relpos_frame(); return f.mac; }\n'
    )
    flags = ["-std=c++11", "-Wall", "-Wextra", "-Werror"]
    path = compile_c(tmp_path, source, flags, compiler="c++", name="program.cpp")
    assert subprocess.run([str(path)]).returncode == 0
