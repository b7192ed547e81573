import numpy as np

from dustfall.sedimentation.closures.contacts import changed_neighbours, contacts


def test_changes_of_neighbours_are_told_apart():
    before = np.array([[1, 2, 3, 4, 5]] * 6, np.int32)
    index = np.array(
        [
            [1, 2, 3, 4, 5],
            [5, 4, 3, 2, 1],  # another order of the same five
            [1, 2, 3, 4, 9],  # only the fifth
            [2, 1, 4, 3, 9],  # only the fifth, and another order
            [1, 2, 3, 9, 4],  # the new one is nearer than the fifth
            [1, 2, 3, 8, 9],  # two are new
        ],
        np.int32,
    )
    assert changed_neighbours(index, before) == (4, 2)
    # The fourth has left, and the new one is the fifth.
    assert changed_neighbours(np.array([[1, 2, 3, 5, 9]], np.int32), before[:1]) == (1, 0)


def test_pairs_below_contact_count_once_and_neighbours_as_often_as_they_are_seen():
    index = np.array([[1, 2, 3, 4, 5], [0, 2, 3, 4, 5], [0, 1, 3, 4, 5]], np.int32)
    vectors = np.full((3, 5, 3), 2.0)
    vectors[0, 0] = [0.5, 0, 0]  # 0 and 1 see each other
    vectors[1, 0] = [-0.5, 0, 0]
    vectors[2, 3] = [0, 0.9, 0]  # 4 is not shown 2
    index = np.vstack([index, [[9, 8, 7, 6, 5]] * 2]).astype(np.int32)
    vectors = np.vstack([vectors, np.full((2, 5, 3), 2.0)])
    rows = np.arange(len(index))
    assert contacts(vectors, rows, index) == (2, 3)
    assert contacts(vectors[::-1].copy(), rows[::-1].copy(), index) == (2, 3)
    assert contacts(2.1 * vectors, rows, index) == (0, 0)
