"""Rotations between two others."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


def turned(R_from: FloatArray, R_to: FloatArray, parameter: FloatArray) -> FloatArray:
    """(n, 3, 3) rotations at parameters in 0 to 1 of the turn from one rotation to another, (n, 3, 3) both.

    At constant speed about one axis, by the smaller angle (Shoemake: Animating rotation with quaternion curves, 1985).
    """
    w, axis = _half_turn(np.swapaxes(R_from, 1, 2) @ R_to)
    length = np.linalg.norm(axis, axis=1)
    angle = 2 * np.arctan2(length, w) * parameter
    unit = axis / np.where(length > 0, length, 1.0)[:, None]
    cross = np.zeros((len(unit), 3, 3))
    cross[:, [2, 0, 1], [1, 2, 0]] = unit
    cross[:, [1, 2, 0], [2, 0, 1]] = -unit
    sine, versine = np.sin(angle)[:, None, None], (1 - np.cos(angle))[:, None, None]
    placed: FloatArray = R_from @ (np.eye(3) + sine * cross + versine * (cross @ cross))
    return placed


def _half_turn(R: FloatArray) -> tuple[FloatArray, FloatArray]:
    # Unit quaternions, w >= 0, from the column of 4 q q^T with the largest diagonal: nothing small is divided by.
    diagonal = np.diagonal(R, axis1=1, axis2=2)
    trace = diagonal.sum(axis=1)
    products = np.empty((len(R), 4, 4))
    products[:, 0, 0] = 1 + trace
    products[:, 0, 1:] = products[:, 1:, 0] = np.stack(
        [R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1
    )
    products[:, 1:, 1:] = R + np.swapaxes(R, 1, 2)
    products[:, [1, 2, 3], [1, 2, 3]] = 1 + 2 * diagonal - trace[:, None]
    largest = np.argmax(np.diagonal(products, axis1=1, axis2=2), axis=1)
    q = products[np.arange(len(R)), largest]
    q = q / np.linalg.norm(q, axis=1, keepdims=True)
    q = np.where(q[:, :1] < 0, -q, q)
    return q[:, 0], q[:, 1:]
