"""A 5 x 7 pixel alphabet, and text drawn with it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

#: Seven rows of five pixels, the leftmost pixel the highest bit, written in base 32.
_GLYPHS = {
    "A": "ehhvhhh", "B": "uhhuhhu", "C": "ehggghe", "D": "uhhhhhu", "E": "vgguggv",
    "F": "vgguggg", "G": "ehgnhhf", "H": "hhhvhhh", "I": "e44444e", "J": "72222ic",
    "K": "hikokih", "L": "ggggggv", "M": "hrllhhh", "N": "hphljhh", "O": "ehhhhhe",
    "P": "uhhuggg", "Q": "ehhhlid", "R": "uhhukih", "S": "fgge11u", "T": "v444444",
    "U": "hhhhhhe", "V": "hhhhha4", "W": "hhhllrh", "X": "hha4ahh", "Y": "hha4444",
    "Z": "v1248gv", "0": "ehjlphe", "1": "4c4444e", "2": "eh1248v", "3": "v24211e",
    "4": "26aiv22", "5": "vgu11he", "6": "68guhhe", "7": "v124888", "8": "ehhehhe",
    "9": "ehhf12c", "-": "000v000", "'": "4480000", "+": "044v440", " ": "0000000",
}  # fmt: skip


def text_mask(text: str, scale: int) -> npt.NDArray[np.bool_]:
    """``text`` as (7 scale, 6 scale len(text)) pixels, True where there is ink.

    Raises KeyError for a letter that the alphabet has not got.
    """
    rows = [[int(row, 32) for row in _GLYPHS[letter]] for letter in text]
    bits = (np.array(rows)[:, :, None] >> np.arange(4, -1, -1)) & 1  # letter, row, column
    cell = np.zeros((len(text), 7, 6), dtype=bool)
    cell[:, :, :5] = bits
    line = cell.transpose(1, 0, 2).reshape(7, -1)
    return line.repeat(scale, axis=0).repeat(scale, axis=1)
