"""Finding a phrase by some of its letters."""

WORD_START, RUN, GAP = 8, 6, 1


def fuzzy_score(query: str, text: str) -> int | None:
    """How well the letters of a query occur in a text, in order.

    Letters at the start of a word and letters in a row count more; skipped letters cost a little, so that "wei" finds
    "Show weights" before "When it is". Case and spaces of the query do not matter.

    Returns
    -------
    int or None
        Higher is better; None where a letter is missing.
    """
    letters = query.casefold().replace(" ", "")
    text = text.casefold()
    if not letters:
        return 0
    # best[i]: score of the letters so far with the newest one at place i of the text.
    best: dict[int, int] = {-1: 0}
    for letter in letters:
        found: dict[int, int] = {}
        for i, there in enumerate(text):
            if there != letter:
                continue
            bonus = WORD_START if i == 0 or not text[i - 1].isalnum() else 0
            scores = [
                score + (RUN if i == before + 1 and before >= 0 else -GAP * min(i - before - 1, 5))
                for before, score in best.items()
                if before < i
            ]
            if scores:
                found[i] = bonus + max(scores)
        if not found:
            return None
        best = found
    return max(best.values())
