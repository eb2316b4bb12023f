"""The list of the paper's sentences: each is judged once, and quoted shortly."""

from amiri2026.paper.judging import JUDGES, chosen_sentences
from amiri2026.paper.recorded import recorded
from amiri2026.sensitivity.claims import CLAIMS
from amiri2026.sentences import PARTS, sentences


def test_every_sentence_has_one_judge_and_every_judge_a_sentence() -> None:
    assert set(JUDGES) == set(sentences())
    assert len(sentences()) == len(chosen_sentences()) == 90


def test_sentences_stand_in_the_order_of_the_paper() -> None:
    def place(name: str) -> tuple[int, float]:
        part, _, number = name.partition(".")
        # The table stands between the sentences 8 and 9 of its section.
        return list(PARTS).index(part), 8.5 if number == "T1" else float(number)

    places = [place(name) for name in sentences()]
    assert places == sorted(set(places))


def test_quotations_are_short_and_every_criterion_is_told() -> None:
    for sentence in sentences().values():
        assert 0 < len(sentence.quote.replace("…", "").split()) <= 25, sentence.id
        for text in (sentence.claims, sentence.measure, sentence.criterion):
            assert text.endswith("."), sentence.id


def test_the_record_holds_every_sentence() -> None:
    assert [entry["id"] for entry in recorded()["sentences"]] == list(sentences())


def test_the_claims_of_the_sensitivity_section_are_its_sentences() -> None:
    assert list(CLAIMS) == [name for name in sentences() if name.startswith("IV-B.")]
