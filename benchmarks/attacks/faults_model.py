"""Faults of the model and what it is solved with: prediction, regions, linear programs."""

from benchmarks.attacks.fault import Fault

NETWORK = (
    Fault(
        "active_neurons_inverted",
        "relu.forward",
        "active.append(z > 0)",
        "active.append(z < 0)",
        (
            "tests/network/test_predict.py"
            "::test_a_prediction_is_the_network_time_major_from_the_start",
        ),
    ),
    Fault(
        "knots_axis_major",
        "predict.predict",
        ".reshape(-1, layout.n_c), y[layout.n_offsets :]",
        ".reshape(layout.n_c, -1).T, y[layout.n_offsets :]",
        (
            "tests/network/test_predict.py"
            "::test_a_prediction_is_the_network_time_major_from_the_start",
        ),
    ),
    Fault(
        "accelerator_products_rounded",
        "common.arrays",
        "Precision.HIGHEST",
        "Precision.DEFAULT",
        ("tests/verdict/test_pointwise.py::test_every_product_of_a_verdict_keeps_full_precision",),
    ),
    Fault(
        "rounding_of_earlier_layers_forgotten",
        "rounding_bound",
        "error = (np.abs(W) @ error + gamma * absolute",
        "error = (gamma * absolute",
        ("tests/network/test_rounding.py::test_errors_of_earlier_layers_are_carried_on",),
    ),
    Fault(
        "fold_forgets_the_mean",
        "fold.fold",
        "biases[0] -",
        "biases[0] +",
        ("tests/network/test_fold.py::test_folded_network_equals_the_normalised_one",),
    ),
)

REGIONS = (
    Fault(
        "constant_positive_neuron_switched_off",
        "_cut_layers",
        "lattice.bits.mark",
        "if (codes == Sign.MINUS).any():\n                lattice.bits.mark",
        ("tests/pwa/test_degenerate.py::test_dead_layer_feeds_its_bias_forward",),
    ),
    Fault(
        "rows_of_the_other_side",
        "pattern_map",
        "sign = xp.where(on, -1.0, 1.0)",
        "sign = xp.where(on, 1.0, -1.0)",
        ("tests/pwa/test_maps.py::test_one_pattern_and_many_in_numpy_and_jax_agree",),
    ),
    Fault(
        "offset_of_inactive_neurons_kept",
        "pattern_map",
        "on, d, 0.0",
        "on, d, d",
        ("tests/pwa/test_maps.py::test_one_pattern_and_many_in_numpy_and_jax_agree",),
    ),
    Fault(
        "lost_volume_accepted",
        "prove_complete",
        "= VOLUME_RELATIVE",
        "= 1",
        ("tests/pwa/test_guards.py::test_missing_volume",),
    ),
    Fault(
        "lost_face_accepted",
        "prove_complete",
        "proof.euler !=",
        "proof.euler >",
        ("tests/pwa/test_guards.py::test_missing_face",),
    ),
    Fault(
        "same_region_twice_accepted",
        "prove_complete",
        "if not _all_distinct(plus)",
        "if not len(plus)",
        ("tests/pwa/test_guards.py::test_same_pattern_twice",),
    ),
    Fault(
        "exact_zero_is_active",
        "sign_of",
        "value > 0:\n        return",
        "value >= 0:\n        return",
        ("tests/pwa/test_degenerate.py::test_integer_weights_meet_everywhere",),
    ),
)

PROGRAMS = (
    Fault(
        "solver_trouble_read_as_empty",
        "common.lp.solve",
        "return _result(lp, LPStatus.UNKNOWN, None, hint, -np.inf)\n\n\ndef",
        "return _result(lp, LPStatus.INFEASIBLE, None, hint, -np.inf)\n\n\ndef",
        ("tests/lp/test_failures.py::test_limits_and_almost_answers_are_unknown",),
    ),
    Fault(
        "emptiness_without_a_proof",
        "solve._checked",
        '" and _lower_bound(lp, np.zeros(lp.n), hint) > TOLERANCES.lp_margin',
        '"',
        ("tests/lp/test_failures.py::test_a_lying_solver_never_makes_a_set_empty",),
    ),
    Fault(
        "points_not_checked",
        "_with_point",
        "not violation(x, A, b, lp.lo, lp.hi) <= TOLERANCES.lp_feasible",
        "violation(x, A, b, lp.lo, lp.hi) > 1e9",
        ("tests/lp/test_failures.py::test_swapped_verdicts_do_not_pass",),
    ),
    Fault(
        "dual_bound_without_rounding",
        "dual_bound",
        "- gamma(h + n + 4) * size - (h + n) * _TINY",
        "",
        ("tests/lp/test_witness.py::test_float_bound_is_below_the_rational_bound_and_close",),
    ),
)

MODEL = (*NETWORK, *REGIONS, *PROGRAMS)
