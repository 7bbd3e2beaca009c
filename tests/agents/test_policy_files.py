"""Policy files: valid ones run, all others are refused with a reason."""

import io
import os
import pickle
import time
import zipfile
from contextlib import suppress
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import onnx
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from onnx import TensorProto, helper, numpy_helper
from policy_files import (
    LAYOUT,
    card_of,
    forward,
    good_model,
    model,
    node,
    perceptron,
    put,
)

from agents.errors import UsageError
from agents.policies import Layout, PolicyError, find, load_policy, shipped_names, write_policy
from agents.policies.graph import check_graph
from agents.policies.patience import Patience
from agents.policies.trained import check_policy

GOOD = good_model().SerializeToString()
SIZE = LAYOUT.size


def observations(*lead, seed=0):
    return np.random.default_rng(seed).normal(0.0, 1.0, (*lead, SIZE)).astype(np.float32)


@pytest.fixture
def good(tmp_path):
    write_policy(tmp_path, "good", GOOD, card_of(GOOD))
    return tmp_path / "good.onnx"


@pytest.mark.parametrize("lead", [(), (1,), (5,), (4, 3), (0,), (2, 0)], ids=str)
def test_a_policy_acts_as_its_network(good, lead):
    policy = load_policy(good)
    _, arrays = perceptron()
    seen = observations(*lead)
    actions = policy.act(seen)
    assert actions.shape == (*lead, 2)
    assert actions.dtype == np.float32
    assert np.allclose(actions, forward(arrays, seen), atol=1e-5)
    assert np.allclose(policy.act(seen.astype(np.float64)), actions)
    assert np.allclose(
        policy.act(seen[..., ::-1])[..., 0], policy.act(seen[..., ::-1].copy())[..., 0]
    )


def test_every_way_to_name_it(good, monkeypatch, tmp_path):
    card = load_policy(good).card
    assert card.name == "good"
    for way in (str(good), good.with_suffix(".json"), good.parent, str(good.parent)):
        assert load_policy(way).card == card
    monkeypatch.setattr(find, "SHIPPED", tmp_path)
    assert shipped_names() == ["good"]
    assert load_policy("good").card == card


def test_shipped_policies_load():
    for name in shipped_names():
        assert load_policy(name).card.name == name


def test_few_cars_are_driven_as_if_the_rest_were_absent(tmp_path):
    six = Layout("estimate", 6)
    data = good_model(size=six.size).SerializeToString()
    write_policy(tmp_path, "six", data, replace(card_of(data), layout=six))
    policy = load_policy(tmp_path)
    assert policy.driver(six) is policy
    driver = policy.driver(Layout("truth", 3))
    seen = observations(4, 3)
    padded = np.zeros((4, 3, six.size), np.float32)
    padded[..., six.padding_from(LAYOUT) >= 0] = seen
    assert np.allclose(driver.act(seen), policy.act(padded), atol=1e-6)
    assert driver.act(seen[0, 0]).shape == (2,)
    for layout, reason in (
        (Layout("estimate", 7), "more cars than the policy has slots for"),
        (Layout("estimate", 6, 2), "the history differs"),
        (Layout("ranges", 3), "expected observation 'estimate' of 6 cars, got"),
    ):
        with pytest.raises(PolicyError, match=reason):
            policy.driver(layout)
    with pytest.raises(PolicyError, match=r"a decision every 0.1 s, got 0.05 s"):
        policy.driver(six, decision=0.05)


def test_wrong_observations_are_named(good):
    policy = load_policy(good)
    with pytest.raises(
        PolicyError, match=r"good: observations: expected \(\.\.\., 22\), got \(3, 21\)"
    ):
        policy.act(np.zeros((3, 21), np.float32))
    with pytest.raises(PolicyError, match="expected finite numbers"):
        policy.act(np.full(SIZE, np.nan))


def refused(folder, data, reason, card=None):
    path = put(folder, data, card)
    with pytest.raises(PolicyError) as caught:
        load_policy(path)
    assert reason in str(caught.value), caught.value
    assert str(caught.value).isprintable()
    assert str(folder) in str(caught.value)


class Bomb:
    """Payload of a pickle that runs when it is loaded."""

    def __reduce__(self):
        return (os.mkdir, ("exploded",))


def archive():
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as file:
        file.writestr("data.pkl", pickle.dumps(Bomb()))
    return stream.getvalue()


@pytest.mark.parametrize("suffix", [".zip", ".pkl", ".pt", ".PTH", ".npy"])
@pytest.mark.parametrize("there", [True, False])
def test_files_of_trainers_are_not_opened(tmp_path, monkeypatch, suffix, there):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / f"policy{suffix}"
    if there:
        path.write_bytes(pickle.dumps(Bomb()))
    with pytest.raises(PolicyError, match="execute code when it is loaded.*relpos export"):
        load_policy(path)
    assert not (tmp_path / "exploded").exists()


@pytest.mark.parametrize(
    ("data", "reason"),
    [(pickle.dumps(Bomb()), "is a pickle"), (archive(), "is a zip archive"),
     (pickle.dumps(Bomb(), protocol=0), "is no ONNX file")],
    ids=["pickle", "zip", "old pickle"],
)  # fmt: skip
def test_renamed_pickles_are_refused(tmp_path, monkeypatch, data, reason):
    monkeypatch.chdir(tmp_path)
    refused(tmp_path, data, reason)
    assert not (tmp_path / "exploded").exists()


@given(data=st.binary(max_size=300))
@example(b"")
@example(b"ORTM" * 10)
@example(b"\x00\x00\x00\x00ORTM" + bytes(100))
def test_random_bytes_are_refused(data):
    with pytest.raises(PolicyError, match="^it: "):
        check_policy(data, card_of(data), "it")


@given(end=st.integers(0, len(GOOD) - 1))
def test_truncated_files_are_refused_or_harmless(end):
    """A file may lose its end, the version; then onnxruntime or the trial run decides."""
    data = GOOD[:end]
    with pytest.raises(PolicyError, match="^it: "):
        check_policy(data, card_of(GOOD), "it")
    judged(data)


@given(flips=st.lists(st.tuples(st.integers(0, len(GOOD) - 1), st.integers(0, 7)), min_size=1))
@settings(suppress_health_check=[HealthCheck.too_slow])
def test_flipped_bits_never_come_through(flips):
    data = bytearray(GOOD)
    for at, bit in flips:
        data[at] ^= 1 << bit
    data = bytes(data)
    if data != GOOD:
        with pytest.raises(PolicyError, match="is not the network of the card"):
            check_policy(data, card_of(GOOD), "it")
    judged(data)


def judged(data):
    """With a matching hash it runs within its limits or is refused with a reason."""
    try:
        network = check_policy(data, card_of(data), "it")
    except PolicyError as error:
        reason = str(error)
        assert reason.isprintable()  # noqa: PT017
        return
    assert np.abs(network(observations(3))).max() <= 1.0


def altered(change):
    made = good_model()
    change(made)
    return made.SerializeToString()


def outside(location):
    def change(made):
        tensor = made.graph.initializer[0]
        tensor.ClearField("raw_data")
        tensor.data_location = TensorProto.EXTERNAL
        for key, value in (("location", location), ("length", "704")):
            entry = tensor.external_data.add()
            entry.key, entry.value = key, value

    return altered(change)


@pytest.mark.parametrize("place", ["/etc/passwd", "../x", "weights.bin", "*/_ORT_MEM_ADDR_/*"])
def test_data_in_other_files_are_never_read(tmp_path, monkeypatch, place):
    (tmp_path / "weights.bin").write_bytes(bytes(704))
    monkeypatch.chdir(tmp_path)
    refused(tmp_path, outside(place), "data in another file: not allowed")


def test_data_in_other_files_of_an_attribute_neither(tmp_path):
    tensor = numpy_helper.from_array(np.zeros(2, np.float32))
    tensor.data_location = TensorProto.EXTERNAL
    nodes, arrays = perceptron()
    nodes.append(node("Constant", [], ["c"], value=tensor))
    refused(tmp_path, model(nodes, arrays).SerializeToString(), "data in another file")


def with_nodes(*nodes, domains=(), **arrays):
    """Return the perceptron followed by nodes from `x` to `actions`."""
    first, more = perceptron()
    first[-1].output[0] = "x"
    return model([*first, *nodes], more | arrays, domains=domains).SerializeToString()


THEN = helper.make_graph(
    [node("Neg", ["x"], ["y"])],
    "then",
    [],
    [helper.make_tensor_value_info("y", TensorProto.FLOAT, ["batch", 2])],
)
NAN = {"n": np.array([np.nan], np.float32)}
FOREIGN = [
    (
        with_nodes(node("Gelu", ["x"], ["actions"], domain="com.microsoft"),
                   domains=["com.microsoft"]),
        "operators of domain 'com.microsoft'",
    ),
    (with_nodes(node("Neg", ["x"], ["actions"], domain="my"), domains=["my"]), "domain 'my'"),
    (with_nodes(node("Mine\x1b[2J", ["x"], ["actions"])), "operator 'Mine\\x1b[2J'"),
    (with_nodes(node("RandomNormalLike", ["x"], ["actions"])), "operator 'RandomNormalLike'"),
    (
        with_nodes(node("If", ["c"], ["actions"], then_branch=THEN, else_branch=THEN),
                   c=np.array(True)),
        "operator 'If'",
    ),
    (with_nodes(node("Neg", ["x"], ["actions"], then=THEN)), "a graph inside an operator"),
    (with_nodes(node("Mul", ["x", "n"], ["actions"]), **NAN), "expected finite numbers"),
    (with_nodes(node("Add", ["x", "n"], ["actions"]), n=np.float32([1.0])), "expected -1 to 1"),
    (
        with_nodes(node("ReduceMean", ["x"], ["m"], axes=[0]),
                   node("Mul", ["x", "m"], ["actions"])),
        "expected the same alone and in a batch",
    ),
    (with_nodes(node("Neg", ["nowhere"], ["actions"])), "onnxruntime refuses it"),
    (model(*perceptron(size=21), size=21).SerializeToString(), "expected shape (batch, 22), got"),
    (model(*perceptron(), batch=1).SerializeToString(), "expected shape (batch, 22), got (1, 22)"),
    (
        model(*perceptron(), names=("observations", "g0")).SerializeToString(),
        "expected 'actions' alone, got 'g0'",
    ),
    (altered(lambda m: m.graph.output.append(
        helper.make_tensor_value_info("g0", TensorProto.FLOAT, ["batch", 8]))),
     "expected 'actions' alone, got 'actions', 'g0'"),
    (altered(lambda m: m.graph.input.append(
        helper.make_tensor_value_info("more", TensorProto.FLOAT, [1]))),
     "expected 'observations' alone, got 'observations', 'more'"),
    (
        model([node("Slice", ["observations", "a", "b", "c"], ["actions"])],
              {"a": np.array([0]), "b": np.array([2]), "c": np.array([1])},
              kind=TensorProto.DOUBLE).SerializeToString(),
        "expected tensor(float), got tensor(double)",
    ),
    (altered(lambda m: m.functions.add()), "functions of its own"),
    (altered(lambda m: m.training_info.add()), "training: not allowed"),
    (altered(lambda m: m.graph.sparse_initializer.add()), "a sparse tensor"),
    (altered(lambda m: setattr(m.opset_import[0], "version", 9999)), "onnxruntime refuses it"),
    (altered(lambda m: setattr(m, "ir_version", 9999)), "onnxruntime refuses it"),
    (altered(lambda m: m.ClearField("graph")), "onnxruntime refuses it"),
    (altered(lambda m: m.graph.node.extend([onnx.NodeProto()] * 201_000)), "too many parts"),
]  # fmt: skip


@pytest.mark.parametrize("shape", [(5_000, 10_000), (10**6, 10**6), (2**31, 2**31)], ids=str)
def test_a_small_file_does_not_take_all_memory(tmp_path, capfd, shape):
    """Sizes are half as large again as allowed, and more."""
    data = with_nodes(
        node("Expand", ["one", "shape"], ["large"]),
        node("ReduceMax", ["large"], ["most"], keepdims=0),
        node("Mul", ["x", "most"], ["actions"]),
        one=np.ones((1, 1), np.float32),
        shape=np.array(shape),
    )
    refused(tmp_path, data, "onnxruntime")
    assert capfd.readouterr() == ("", "")


def test_a_small_file_does_not_take_all_time(tmp_path):
    """Products of constants take minutes: they are neither folded nor run to the end."""
    data = with_nodes(
        node("Expand", ["one", "shape"], ["m0"]),
        *(node("MatMul", [f"m{k}", "m0"], [f"m{k + 1}"]) for k in range(300)),
        node("ReduceMax", ["m300"], ["most"], keepdims=0),
        node("Mul", ["x", "most"], ["actions"]),
        one=np.zeros((1, 1), np.float32),
        shape=np.array((1800, 1800)),
    )
    refused(tmp_path, data, "a step takes longer than 1 s")


@pytest.mark.parametrize(
    ("data", "reason"), FOREIGN, ids=lambda v: v[:40] if isinstance(v, str) else ""
)
def test_foreign_networks_are_refused(tmp_path, data, reason):
    refused(tmp_path, data, reason)
    with pytest.raises(PolicyError):
        write_policy(tmp_path / "out", "test", data, card_of(data))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("value", [b"\x70\x02", b"\x70\x80\x80\x80\x80\x10", b"\x72\x01\x01"])
def test_no_spelling_of_a_place_of_data_comes_through(value):
    """Field 14 of a tensor as a larger number, and as bytes, added at the end of an initializer."""
    tensor = GOOD_TENSOR + value
    with pytest.raises(PolicyError, match="data in another file"):
        check_graph(wrapped(7, wrapped(5, tensor)), "it")


GOOD_TENSOR = good_model().graph.initializer[0].SerializeToString()


def wrapped(number, data):
    """Encode a field with a message."""
    length, size = b"", len(data)
    while size > 0x7F:
        length, size = length + bytes([size & 0x7F | 0x80]), size >> 7
    return bytes([number << 3 | 2]) + length + bytes([size]) + data


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"max_speed": 3.0}, "is for speed up to 3 m/s, expected 2"),
        ({"max_steering": 0.5}, "is for steering up to 0.5 rad, expected 0.42"),
        ({"layout": Layout("estimate", 4)}, "expected shape (batch, 30), got (batch, 22)"),
        ({"onnx_sha256": "0" * 64}, "is not the network of the card"),
    ],
    ids=str,
)
def test_a_card_of_another_policy_is_refused(tmp_path, changes, reason):
    refused(tmp_path, GOOD, reason, replace(card_of(GOOD), **changes))


def test_a_card_of_a_future_version_is_refused(tmp_path):
    text = card_of(GOOD).to_json().replace('"format": 1', '"format": 2')
    put(tmp_path, GOOD, text)
    with pytest.raises(
        PolicyError, match="test.json: format: expected 1, got 2: of another version"
    ):
        load_policy(tmp_path)


def test_a_policy_without_card_or_network_is_refused(good):
    good.with_suffix(".json").unlink()
    with pytest.raises(PolicyError, match="good.json: no such file; a policy is name.onnx and"):
        load_policy(good)
    good.unlink()
    with pytest.raises(PolicyError, match="expected one policy in the folder, got none"):
        load_policy(good.parent)


def test_a_folder_of_several_is_no_policy(good):
    put(good.parent, GOOD, name="another")
    with pytest.raises(
        PolicyError, match="expected one policy in the folder, got another.onnx, good"
    ):
        load_policy(good.parent)


def test_what_is_no_file_is_refused(tmp_path):
    loop = tmp_path / "loop.onnx"
    loop.symlink_to(loop)
    (tmp_path / "folder.onnx").mkdir()
    (tmp_path / "folder.json").write_text(card_of(GOOD).to_json())
    os.mkfifo(tmp_path / "pipe.onnx")
    (tmp_path / "pipe.json").write_text(card_of(GOOD).to_json())
    (tmp_path / "zero.onnx").symlink_to("/dev/zero")
    (tmp_path / "zero.json").symlink_to("/dev/zero")
    (tmp_path / "text.txt").write_text("hello")
    for name_or_path, reason in (
        (loop, "cannot be read"),
        (tmp_path / "folder.json", "cannot be read|expected an ordinary file"),
        (tmp_path / "pipe.onnx", "expected an ordinary file"),
        (tmp_path / "zero.onnx", "expected an ordinary file"),
        (tmp_path / "text.txt", "expected a file .onnx or .json"),
        (tmp_path / "none.onnx", "no such file or folder"),
        ("no such name", "no policy of that name"),
        ("", "expected one policy in the folder|no such file"),
        ("nul\0l", "cannot be read"),
        ("x" * 5000, "cannot be read"),
    ):
        with pytest.raises(PolicyError, match=reason) as caught:
            load_policy(name_or_path)
        assert str(caught.value).isprintable()


def test_nothing_is_printed_by_others(tmp_path, capfd):
    for old, new in ((b"policy", b"p\xe2licy"), (b"batch", b"b\xe2tch"), (b"Gemm", b"Relu")):
        data = GOOD.replace(old, new).replace(b"\x12\x06p\xe2", b"\x12\x07p\xe2")
        path = put(tmp_path, data, card_of(data))
        with suppress(PolicyError):
            load_policy(path)
    assert capfd.readouterr() == ("", "")


def test_large_files_are_not_read(good, monkeypatch):
    import agents.policies.trained

    monkeypatch.setattr(agents.policies.trained, "MOST_NETWORK", 100)
    with pytest.raises(PolicyError, match="expected at most"):
        load_policy(good)
    monkeypatch.setattr(agents.policies.trained, "MOST_CARD", 100)
    with pytest.raises(PolicyError, match="good.json: expected at most"):
        load_policy(good)


def test_both_files_are_written_or_none(tmp_path):
    (tmp_path / "good.json").mkdir()
    with pytest.raises(UsageError, match="good.json is a folder"):
        write_policy(tmp_path, "good", GOOD, card_of(GOOD))
    assert [p.name for p in tmp_path.iterdir()] == ["good.json"]
    written = write_policy(tmp_path / "new", "fine", GOOD, card_of(b"other"))
    assert load_policy(tmp_path / "new").card == written
    with pytest.raises(PolicyError, match="name: expected a name"):
        write_policy(tmp_path, "../escape", GOOD, card_of(GOOD))


def test_a_refusal_reaches_other_processes_whole():
    told = PolicyError("a\nb.onnx", "expected finite numbers, got others")
    again = pickle.loads(pickle.dumps(told))
    assert isinstance(again, PolicyError)
    assert (str(again), again.where, again.reason) == (str(told), told.where, told.reason)


def test_a_card_too_large_to_be_loaded_is_not_written(tmp_path):
    results = ({"x": "0" * find.MOST_CARD},)
    with pytest.raises(PolicyError, match="the card has .* bytes, expected"):
        write_policy(tmp_path, "large", GOOD, replace(card_of(GOOD), results=results))
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("slow", [False, True])
def test_only_a_run_that_lasts_is_ended(slow):
    patience, run = Patience(0.15), SimpleNamespace(terminate=False)
    with patience.over(run):
        for _ in range(400 if slow else 1):
            if run.terminate:
                break
            time.sleep(0.01)
    time.sleep(0.0 if slow else 0.4)
    assert run.terminate == slow
