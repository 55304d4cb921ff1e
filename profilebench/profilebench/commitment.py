"""Sealed truth: hidden until the key is shown, and not changeable in between.

Everything follows from one key. The seed of an evaluation sequence is an HMAC of the key, so that nobody without it
can cast the sequence again. Its truth is stored as a stream-ciphered file, and the SHA-256 of salt and truth is
published with the track. Whoever gets the key opens the truth and checks it against what was published.
"""

import hashlib
import hmac
import json
from typing import Any

TRAINING_KEY = b"profilebench-training-1"
"""Public: the truth of the training part is open."""
PRACTICE_KEY = b"profilebench-practice-1"
"""Public as well: the evaluation part of the tables in README.md. A contest draws a key of its own."""


class SealError(ValueError):
    """A sealed truth that does not open, or is not the one that was committed to."""


def seed(key: bytes, name: str) -> int:
    """Seed of a sequence."""
    return int.from_bytes(_derived(key, "seed:" + name)[:16], "big")


def canonical(truth: dict[str, Any]) -> bytes:
    """The one spelling of a truth that is hashed."""
    return json.dumps(truth, sort_keys=True, separators=(",", ":")).encode()


def commitment(key: bytes, name: str, truth: dict[str, Any]) -> str:
    """Published commitment to a truth: SHA-256 of a secret salt and its canonical form."""
    return hashlib.sha256(_derived(key, "salt:" + name) + canonical(truth)).hexdigest()


def key_commitment(key: bytes) -> str:
    """Published commitment to the key itself.

    >>> key_commitment(PRACTICE_KEY)[:8]
    '2cddf8a0'
    """
    return hashlib.sha256(b"profilebench-key:" + key).hexdigest()


def seal(key: bytes, name: str, truth: dict[str, Any]) -> bytes:
    """The truth, unreadable without the key."""
    return _masked(key, name, canonical(truth))


def unseal(key: bytes, name: str, sealed: bytes, published: str) -> dict[str, Any]:
    """The truth of a sealed file, checked against the published commitment."""
    try:
        truth = json.loads(_masked(key, name, sealed))
    except (UnicodeDecodeError, json.JSONDecodeError):
        raise SealError(f"{name}: this key does not open the truth") from None
    if not isinstance(truth, dict) or commitment(key, name, truth) != published:
        raise SealError(f"{name}: the truth is not the one that was committed to")
    return truth


def _derived(key: bytes, purpose: str) -> bytes:
    return hmac.new(key, purpose.encode(), hashlib.sha256).digest()


def _masked(key: bytes, name: str, data: bytes) -> bytes:
    stream = hashlib.shake_256(_derived(key, "mask:" + name)).digest(len(data))
    return bytes(a ^ b for a, b in zip(data, stream, strict=True))
