"""Faults of the model and what it is solved with: prediction, regions, linear programs."""

from benchmarks.attacks.fault import Fault

NETWORK = (
    Fault(
        "active_neurons_inverted",
        "parc_jax/network/predict.py",
        "active.append(z > 0)",
        "active.append(z < 0)",
        (
            "tests/network/test_predict.py"
            "::test_a_prediction_is_the_network_time_major_from_the_start",
        ),
    ),
    Fault(
        "knots_axis_major",
        "parc_jax/network/predict.py",
        "return knots.reshape(-1, layout.n_c), y[layout.n_offsets :], active",
        "return knots.reshape(layout.n_c, -1).T, y[layout.n_offsets :], active",
        (
            "tests/network/test_predict.py"
            "::test_a_prediction_is_the_network_time_major_from_the_start",
        ),
    ),
    Fault(
        "accelerator_products_rounded",
        "parc_jax/network/predict.py",
        "HIGHEST = jax.lax.Precision.HIGHEST",
        "HIGHEST = jax.lax.Precision.DEFAULT",
        ("tests/verdict/test_pointwise.py::test_every_product_of_a_verdict_keeps_full_precision",),
    ),
    Fault(
        "rounding_of_earlier_layers_forgotten",
        "parc_jax/network/rounding.py",
        "error = (np.abs(W) @ error + gamma * absolute",
        "error = (gamma * absolute",
        ("tests/network/test_rounding.py::test_errors_of_earlier_layers_are_carried_on",),
    ),
    Fault(
        "fold_forgets_the_mean",
        "parc_jax/network/fold.py",
        "biases[0] = biases[0] - first @ norm.x_mean",
        "biases[0] = biases[0] + first @ norm.x_mean",
        ("tests/network/test_fold.py::test_folded_network_equals_the_normalised_one",),
    ),
)

REGIONS = (
    Fault(
        "constant_positive_neuron_switched_off",
        "parc_jax/pwa/subdivide.py",
        "            lattice.bits.mark(column, codes)\n            column += 1",
        "            if (codes == Sign.MINUS).any():\n"
        "                lattice.bits.mark(column, codes)\n            column += 1",
        ("tests/pwa/test_degenerate.py::test_dead_layer_feeds_its_bias_forward",),
    ),
    Fault(
        "rows_of_the_other_side",
        "parc_jax/pwa/maps.py",
        "sign = xp.where(on, -1.0, 1.0)",
        "sign = xp.where(on, 1.0, -1.0)",
        ("tests/pwa/test_maps.py::test_one_pattern_and_many_in_numpy_and_jax_agree",),
    ),
    Fault(
        "offset_of_inactive_neurons_kept",
        "parc_jax/pwa/maps.py",
        "d = xp.where(on, d, 0.0)",
        "d = xp.where(on, d, d)",
        ("tests/pwa/test_maps.py::test_one_pattern_and_many_in_numpy_and_jax_agree",),
    ),
    Fault(
        "lost_volume_accepted",
        "parc_jax/pwa/proof.py",
        "if not proof.gap <= VOLUME_RELATIVE:",
        "if not proof.gap <= 1:",
        ("tests/pwa/test_guards.py::test_missing_volume",),
    ),
    Fault(
        "lost_face_accepted",
        "parc_jax/pwa/proof.py",
        "if proof.euler != 1:",
        "if proof.euler > 1:",
        ("tests/pwa/test_guards.py::test_missing_face",),
    ),
    Fault(
        "same_region_twice_accepted",
        "parc_jax/pwa/proof.py",
        "if not _all_distinct(plus):",
        "if not len(plus):",
        ("tests/pwa/test_guards.py::test_same_pattern_twice",),
    ),
    Fault(
        "exact_zero_is_active",
        "parc_jax/pwa/exact.py",
        "    if value > 0:\n        return Sign.PLUS",
        "    if value >= 0:\n        return Sign.PLUS",
        ("tests/pwa/test_degenerate.py::test_integer_weights_meet_everywhere",),
    ),
)

PROGRAMS = (
    Fault(
        "solver_trouble_read_as_empty",
        "parc_jax/lp/solve.py",
        "    return _result(lp, LPStatus.UNKNOWN, None, hint, -np.inf)\n\n\ndef _with_point",
        "    return _result(lp, LPStatus.INFEASIBLE, None, hint, -np.inf)\n\n\ndef _with_point",
        ("tests/lp/test_failures.py::test_limits_and_almost_answers_are_unknown",),
    ),
    Fault(
        "emptiness_without_a_proof",
        "parc_jax/lp/solve.py",
        'hint.kind == "empty" and _lower_bound(lp, np.zeros(lp.n), hint) > TOLERANCES.lp_margin',
        'hint.kind == "empty"',
        ("tests/lp/test_failures.py::test_a_lying_solver_never_makes_a_set_empty",),
    ),
    Fault(
        "points_not_checked",
        "parc_jax/lp/solve.py",
        "if not violation(x, A, b, lp.lo, lp.hi) <= TOLERANCES.lp_feasible:",
        "if violation(x, A, b, lp.lo, lp.hi) > 1e9:",
        ("tests/lp/test_failures.py::test_swapped_verdicts_do_not_pass",),
    ),
    Fault(
        "dual_bound_without_rounding",
        "parc_jax/lp/witness.py",
        "- gamma(h + n + 4) * size - (h + n) * _TINY",
        "",
        ("tests/lp/test_witness.py::test_float_bound_is_below_the_rational_bound_and_close",),
    ),
)

MODEL = (*NETWORK, *REGIONS, *PROGRAMS)
