import numpy as np
import pytest

from twolink.urdf.inertia import principal_moments, violates_triangle


@pytest.mark.parametrize("seed", range(20))
def test_principal_moments_are_eigenvalues(seed):
    random = np.random.default_rng(seed)
    matrix = random.normal(size=(3, 3)) * 10.0 ** random.uniform(-9, 9)
    matrix = matrix + matrix.T
    rows = tuple(tuple(row) for row in matrix.tolist())
    np.testing.assert_allclose(
        principal_moments(rows),  # type: ignore[arg-type]
        np.linalg.eigvalsh(matrix),
        rtol=0,
        atol=1e-14 * np.abs(matrix).max(),
    )


def test_a_diagonal_matrix_is_kept_to_the_last_bit():
    assert principal_moments(((0.3, 0, 0), (0, 0.1, 0), (0, 0, 0.2))) == (0.1, 0.2, 0.3)
    assert principal_moments(((0.0, 1.0, 0), (1.0, 0.0, 0), (0, 0, 0.0))) == (-1.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("moments", "violated"),
    [((1, 1, 2), False), ((1, 1, 2.0001), True), ((0, 1, 1), False), ((0, 0, 1), True)],
)
def test_the_triangle_inequality(moments, violated):
    assert violates_triangle(moments) == violated
