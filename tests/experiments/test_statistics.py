"""Intervals cover, comparisons are by page, and neither depends on the order or the unit of what is measured."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from deskew.errors import InputError
from experiments.reporting.statistics import compare, quantile_interval, share_interval, summarise

# Exact in binary, so that what is equal stays equal when it is moved or scaled.
lengths = st.integers(-1024, 1024).map(lambda n: n / 1024)
few = settings(max_examples=25, deadline=None)


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=30), st.randoms(use_true_random=False))
@few
def test_summary_is_ordered_and_blind_to_the_order_of_trials(values: list[float], shuffler: object) -> None:
    found = summarise(values)
    assert found.n == len(values)
    assert found.minimum <= found.median <= found.maximum
    slack = 1e-9 * max(1.0, abs(found.minimum), abs(found.maximum))
    assert found.minimum - slack <= found.mean <= found.maximum + slack
    if found.interval is not None:
        assert found.minimum - slack <= found.interval[0] <= found.interval[1] <= found.maximum + slack
    if found.p90 is not None:
        assert found.median <= found.p90 <= found.maximum
    shuffler.shuffle(values)  # type: ignore[attr-defined]
    assert summarise(values) == found


def test_interval_of_skewed_values_covers_the_true_mean_about_as_often_as_it_says() -> None:
    # Lognormal with a spread of a half, somewhat more skewed than the pages' errors; 250 tries: +- 1.5 % of coverage.
    rng = np.random.default_rng(50)
    intervals = [summarise(list(rng.lognormal(0.0, 0.5, 50))).interval for _ in range(250)]
    true = np.exp(0.5**2 / 2)
    covered = np.mean([interval is not None and interval[0] <= true <= interval[1] for interval in intervals])
    assert 0.91 < covered < 0.98


def test_interval_of_five_pages_is_wider_than_a_plain_bootstrap_and_as_wide_as_students_at_most() -> None:
    values = np.array([0.12, 0.15, 0.19, 0.22, 0.30])
    low, high = summarise(list(values)).interval or (0.0, 0.0)
    plain = stats.bootstrap((values,), np.mean, method="percentile", random_state=np.random.default_rng(1))
    half = stats.t.ppf(0.975, 4) * values.std(ddof=1) / np.sqrt(5)
    assert 1.2 * (plain.confidence_interval.high - plain.confidence_interval.low) < high - low < 2 * half


@pytest.mark.parametrize("n", [1, 2])
def test_two_pages_have_no_interval(n: int) -> None:
    assert summarise([1.0] * n).interval is None
    assert compare([1.0] * n, [2.0] * n).interval is None


def test_pages_that_agree_have_an_interval_without_width() -> None:
    assert summarise([0.25] * 7).interval == (0.25, 0.25)
    found = compare([1.0, 2.0, 4.0], [2.0, 4.0, 8.0])
    assert found.ratio == 0.5
    assert found.ratio_interval == pytest.approx((0.5, 0.5))


def test_ninth_decile_is_told_from_ten_pages_on() -> None:
    assert summarise(list(range(9))).p90 is None
    assert summarise(list(range(11))).p90 == pytest.approx(9.0)


def test_comparison_in_closed_form() -> None:
    found = compare([1.0, 2.0, 3.0, 5.0], [2.0, 2.0, 2.0, 6.0])
    assert (found.n, found.n_better, found.n_equal) == (4, 2, 1)
    assert found.difference == -0.25
    assert found.ratio == 11 / 12
    assert found.interval is not None
    assert -1.0 <= found.interval[0] < -0.25 < found.interval[1] <= 1.0
    assert compare([1.0, 2.0], [0.0, 2.0]).ratio is None


def test_a_difference_by_page_is_sharper_than_the_pages_are_alike() -> None:
    rng = np.random.default_rng(7)
    pages = rng.lognormal(0.0, 0.5, 50)
    ours = pages - 0.02 + rng.normal(0.0, 0.01, 50)
    low, high = compare(list(ours), list(pages)).interval or (0.0, 0.0)
    assert -0.03 < low < -0.02 < high < -0.01
    alone = summarise(list(pages)).interval or (0.0, 0.0)
    assert high - low < 0.05 * (alone[1] - alone[0])


@given(st.lists(st.tuples(lengths, lengths), min_size=3, max_size=12), lengths, st.sampled_from([0.5, 2.0, 1024.0]))
@few
def test_comparison_moves_and_scales_with_what_is_measured(
    pairs: list[tuple[float, float]], shift: float, scale: float
) -> None:
    one, other = (np.array(values) for values in zip(*pairs, strict=True))
    plain = compare(list(one), list(other))
    moved = compare(list(scale * (one + shift)), list(scale * (other + shift)))
    assert moved.difference == pytest.approx(scale * plain.difference, abs=1e-9 * scale)
    assert plain.interval is not None
    assert moved.interval == pytest.approx(tuple(scale * end for end in plain.interval), abs=1e-6 * scale)
    swapped = compare(list(other), list(one))
    assert swapped.n - swapped.n_equal - swapped.n_better == plain.n_better
    assert swapped.difference == pytest.approx(-plain.difference, abs=1e-12)


@given(st.lists(st.tuples(lengths, lengths), min_size=1, max_size=12), st.randoms(use_true_random=False))
@few
def test_comparison_is_blind_to_the_order_of_pages(pairs: list[tuple[float, float]], shuffler: object) -> None:
    found = compare(*zip(*pairs, strict=True))
    shuffler.shuffle(pairs)  # type: ignore[attr-defined]
    assert compare(*zip(*pairs, strict=True)) == found


@pytest.mark.parametrize(("ones", "others"), [([], []), ([1.0], [1.0, 2.0])])
def test_comparison_refuses_what_is_not_the_same_pages(ones: list[float], others: list[float]) -> None:
    with pytest.raises(InputError, match="must hold"):
        compare(ones, others)


def test_median_of_many_lies_in_its_interval_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(8)
    found = [quantile_interval(list(rng.exponential(size=50)), 0.9) for _ in range(300)]
    true = np.log(10.0)
    covered = np.mean([low is not None and low <= true and (high is None or true <= high) for low, high in found])
    # Order statistics cover at least as often as they say.
    assert 0.94 < covered < 0.995


@pytest.mark.parametrize(("n", "bounded"), [(35, False), (36, True)])
def test_too_few_pages_do_not_bound_a_tail(n: int, bounded: bool) -> None:
    low, high = quantile_interval(list(range(n)), 0.9)
    assert low is not None
    assert (high is not None) == bounded


def test_a_share_of_all_still_has_an_interval() -> None:
    low, high = share_interval(30, 30)
    assert low == pytest.approx(30 / (30 + 1.959964**2))  # Wilson: n / (n + z^2)
    assert high == pytest.approx(1.0)
    assert share_interval(0, 30)[1] == pytest.approx(1 - low)
