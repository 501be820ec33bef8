"""Networks trained elsewhere come in unchanged; what is no chain of linear layers and ReLU is
refused.
"""

import numpy as np
import pytest
from toy_models import host_outputs, random_network

from parc_jax.app.files.network_file import from_state_dict, load_network
from parc_jax.common.errors import InputError
from parc_jax.learning.network.relu import Normalisation


def normalisation(rng, net):
    return Normalisation(
        rng.normal(size=net.n_in),
        rng.uniform(0.5, 2, net.n_in),
        rng.normal(size=net.n_out),
        np.full(net.n_out, 3.0),
    )


def state_of(net):
    parts = {}
    for i, (W, b) in enumerate(zip(net.weights, net.biases, strict=True)):
        parts |= {f"layers.{2 * i}.weight": W, f"layers.{2 * i}.bias": b}
    return parts


def test_npz_and_state_dicts(rng, tmp_path):
    net = random_network(rng, 4)
    np.savez(tmp_path / "net.npz", **state_of(net))
    assert (
        load_network(tmp_path / "net.npz").hash == net.hash == from_state_dict(state_of(net)).hash
    )
    norm, x = normalisation(rng, net), rng.normal(size=(200, 2))
    folded = load_network(tmp_path / "net.npz", norm)
    assert np.allclose(
        host_outputs(folded, x), norm.y_mean + norm.y_scale * host_outputs(net, norm.inputs(x))
    )
    np.savez(tmp_path / "net.npz", **state_of(net), x_mean=norm.x_mean)
    with pytest.raises(InputError, match=r"of linear layers; got 'x_mean'"):
        load_network(tmp_path / "net.npz")


def test_what_is_no_such_network_is_refused(rng, tmp_path):
    state = state_of(random_network(rng, 4))
    with pytest.raises(InputError, match="running_mean"):
        from_state_dict(state | {"norm.running_mean": np.zeros(3)})
    with pytest.raises(InputError, match=r"got 'shift\.bias'"):
        from_state_dict(state | {"shift.bias": np.zeros(3)})
    with pytest.raises(InputError, match="Convolutions"):
        from_state_dict({"conv.weight": np.zeros((4, 3, 5, 5))})
    with pytest.raises(InputError, match=r"weights\[1\] to take the 4 outputs of layer 0; got 5"):
        from_state_dict({"0.weight": np.zeros((4, 3)), "1.weight": np.zeros((2, 5))})
    with pytest.raises(InputError, match=r"expected x_mean \(2,\)"):
        from_state_dict(state, Normalisation(np.zeros(3), np.ones(3), np.zeros(1), np.ones(1)))
    with pytest.raises(InputError, match=r"numbers in '0\.weight'.* complex numbers"):
        from_state_dict({"0.weight": np.zeros((4, 3)) * 1j})
    for name in ("net.h5", "net.npz", "net.onnx"):
        with pytest.raises(InputError):
            load_network(tmp_path / name)


@pytest.mark.parametrize("suffix", [".pt", ".pth", ".h5"])
def test_files_of_torch_are_sent_to_npz(tmp_path, suffix):
    with pytest.raises(InputError, match=r"expected a network as .npz\..*np\.savez\(path"):
        load_network(tmp_path / f"net{suffix}")
