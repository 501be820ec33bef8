"""Faults of the header for a robot's own computer: what C reads, and in which order."""

from benchmarks.attacks.fault import Fault

HEADER = "tests/onboard/test_header.py"
PAID = "tests/onboard/test_paid.py"
SAME = f"{HEADER}::test_a_header_says_what_python_says"
BORDER = f"{PAID}::test_plans_at_the_border_are_as_the_model_says_and_kept_in_exact_numbers"
FAR = f"{HEADER}::test_a_start_so_far_out_that_sums_overflow_is_not_safe"
CODE = "parc_jax/drive/onboard/safe_set.h"
TABLES = "parc_jax/drive/onboard/tables.py"

ONBOARD = (
    Fault(
        "header_compiled_where_nothing_is_nan",
        "header",
        "defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__",
        "0",
        (f"{HEADER}::test_arithmetic_that_the_margins_do_not_pay_for_is_refused",),
    ),
    Fault(
        "header_compiled_for_a_short_double",
        "header",
        "DBL_MANT_DIG != 53",
        "DBL_MANT_DIG < 5",
        (f"{HEADER}::test_arithmetic_that_the_margins_do_not_pay_for_is_refused",),
    ),
    Fault(
        "header_compiled_with_short_literals",
        CODE,
        "sizeof(1.0) == sizeof(double)",
        "sizeof(1.0)",
        (f"{HEADER}::test_literals_that_are_short_are_refused",),
    ),
    Fault(
        "header_believes_compilers_that_know_no_nan",
        CODE,
        "(seen.bits >> 52 & 0x7ff) == 0x7ff",
        "0",
        (f"{HEADER}::test_what_is_not_a_number_is_not_safe",),
    ),
    Fault(
        "header_believes_any_rounding_mode",
        CODE,
        "1.0 + little > 1.0 && -1.0 - little < -1.0",
        "little > 0.0",
        (f"{HEADER}::test_under_another_rounding_mode_nothing_is_safe",),
    ),
    Fault(
        "header_written_of_tables_that_do_not_fit",
        "header.write_c",
        "require_fitting(known, answer.model)",
        "pass",
        (f"{PAID}::test_tables_that_do_not_fit_together_are_refused",),
    ),
    Fault(
        "header_believes_sums_that_overflow",
        CODE,
        "if (!(-NAME_far[c] <= p0[c] && p0[c] <= NAME_far[c]))",
        "if (0)",
        (FAR,),
    ),
    Fault(
        "verdicts_believe_sums_that_overflow",
        "pointwise.arrival",
        "jnp.where(inside < 0, jnp.minimum(goal, inside), goal)",
        "goal",
        (FAR,),
    ),
    Fault(
        "header_written_where_margins_do_not_pay",
        "header.write_c",
        "require_paid(known, answer.model, float(answer.scene.slack))",
        "pass",
        (f"{PAID}::test_nothing_is_written_where_margins_do_not_pay",),
    ),
    Fault(
        "rows_of_a_header_paid_for_by_nobody",
        "paid._rows_paid",
        "norm * off + _lost_by(n + 1, 2 * n, norm * size) <= room * norm",
        "norm * off <= room * norm",
        (f"{PAID}::test_the_slack_pays_with_reserve_and_nothing_does_not",),
    ),
    Fault(
        "faces_of_a_header_paid_for_by_nobody",
        "paid._reaches",
        "n * steep * (2 * centre + cancels)",
        "Fraction(0)",
        (f"{PAID}::test_faces_that_are_not_paid_for_are_refused",),
    ),
    Fault(
        "header_has_slanted_faces_wider_than_the_world",
        "tables.in_numbers",
        "np.where(none[..., None], np.eye(errors.half.shape[-1]), errors.dual)",
        "common.errors.dual",
        (f"{PAID}::test_what_no_face_bounds_is_told_along_the_axes_where_nothing_cancels",),
    ),
    Fault(
        "header_has_its_faces_about_the_opposite_centre",
        CODE,
        "far -= NAME_centre",
        "far += NAME_centre",
        (BORDER,),
    ),
    Fault(
        "header_sees_one_end_of_an_interval",
        CODE,
        "if (!(at_start > least && at_end > least))",
        "if (!(at_start > least))",
        (SAME,),
    ),
    Fault(
        "header_forgets_the_tube_on_the_way",
        CODE,
        "const double least = NAME_run_support[run] + NAME_lost(w, bin, t, point);",
        "const double least = NAME_run_support[run];",
        (SAME,),
    ),
    Fault(
        "header_forgets_the_tube_at_the_end",
        "tables.tables",
        "- lost_at_end",
        "+ 0.0 * lost_at_end",
        (SAME,),
    ),
    Fault(
        "header_lets_borders_of_bins_pass",
        CODE,
        "if (along > 0 && k[j] == edge[along])",
        "if (0)",
        (f"{HEADER}::test_borders_of_bins_and_starts_outside_are_not_safe",),
    ),
    Fault(
        "header_asks_one_point_of_a_part",
        CODE,
        "for (int i = 0; i < NAME_N_PART; ++i) {",
        "for (int i = 0; i < 1; ++i) {",
        (f"{HEADER}::test_bodies_and_fitted_tubes_too",),
    ),
    Fault(
        "header_starts_anywhere",
        CODE,
        "if (!(value <= NAME_start_b[row]))",
        "if (0)",
        (f"{HEADER}::test_borders_of_bins_and_starts_outside_are_not_safe",),
    ),
    Fault(
        "header_offers_what_it_did_not_test",
        CODE,
        "        if (NAME_is_safe(p0, middle))\n",
        "        if (1)\n",
        (f"{HEADER}::test_the_nearest_plan_is_safe_and_near",),
    ),
)
