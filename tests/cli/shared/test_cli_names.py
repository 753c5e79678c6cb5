"""Names of verbs and options: those that are no more, and one meaning for each."""

import re
from functools import cache
from pathlib import Path

import make_options
import pytest

from vibrissa.cli import app
from vibrissa.cli.shared.words.glossary import GLOSSARY, SHARES
from vibrissa.cli.shared.words.renamed import OLD_OPTIONS, SYNONYMS, near_name
from vibrissa.cli.shared.words.units import DIMENSIONS

WORDS = {("--part", "text")}  # two lengths in one word


@cache
def taken(verb):
    """Options that a verb takes."""
    return {name for argument in app[verb].assemble_argument_collection() for name in argument.names}


VERBS = sorted(name for name in app if not name.startswith("-"))
OLD = [(verb, old, new) for verb in VERBS for names in (OLD_OPTIONS.get(verb, {}),) for old, new in names.items()]
OLD += [(verb, old, new) for verb in VERBS for old, new in OLD_OPTIONS[""].items() if {old, new} & taken(verb) == {new}]


@pytest.mark.parametrize(("verb", "old", "new"), OLD)
def test_the_old_name_of_an_option_names_the_new_one(vibrissa, verb, old, new):
    assert old not in taken(verb)
    assert new in taken(verb)
    code, out, err = vibrissa(verb, "x", old, "1")
    assert (code, out, err) == (
        2,
        "",
        f"vibrissa: the option {old} of {verb} is now {new}; see vibrissa {verb} --help\n",
    )


def test_every_old_option_belongs_to_a_verb():
    assert set(OLD_OPTIONS) - {""} <= set(VERBS)


MEANT = [(verb, word) for verb in VERBS for word in SYNONYMS if near_name(word, taken(verb)) is not None]


@pytest.mark.parametrize(("verb", "word"), MEANT)
def test_a_common_word_names_the_option_of_the_verb(vibrissa, verb, word):
    near = near_name(word, taken(verb))
    assert near in taken(verb)
    code, out, err = vibrissa(verb, word, "1")
    meant = OLD_OPTIONS.get(verb, {}).get(word) or OLD_OPTIONS[""].get(word) or near
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert meant in err


def test_every_common_word_is_of_use_and_no_option_itself():
    assert {word for _, word in MEANT} == set(SYNONYMS)
    assert not set(SYNONYMS) & set(GLOSSARY)
    assert {name for names in SYNONYMS.values() for name in names} <= set(GLOSSARY)


KINDS = {name: kinds for name, kinds in make_options.options().items() if name not in ("--help", "--version")}


@pytest.mark.parametrize("option", sorted(KINDS))
def test_an_option_has_the_same_meaning_and_dimension_in_every_verb(option):
    known = GLOSSARY[option]
    kinds = {"text" if known.kind == "point" and kind == "text" else kind for kind in KINDS[option].values()}
    kinds = {known.kind if (option, kind) in WORDS else kind for kind in kinds}
    assert kinds == {known.kind if known.kind != "point" else "text"}, KINDS[option]


def test_the_glossary_has_no_option_that_no_verb_takes():
    assert set(GLOSSARY) == set(KINDS)
    assert set(SHARES) == {name for name, one in GLOSSARY.items() if one.kind == "over length"}


def test_no_two_options_of_the_glossary_mean_the_same():
    meanings = [one.meaning for one in GLOSSARY.values()]
    assert len(set(meanings)) == len(meanings)


SAYS = {
    (argument.name, verb): argument.parameter.help or ""
    for verb in VERBS
    for argument in app[verb].assemble_argument_collection(parse_docstring=True)
    if not argument.children and argument.name in GLOSSARY
}
SPECIAL = re.compile(r"^(About the profile|For curved modes|With tracks|Instead): ")  # where it is taken


@pytest.mark.parametrize("option", sorted({option for option, _ in SAYS}))
def test_help_begins_with_what_the_option_means_in_the_glossary(option):
    """Of a quantity its first two words, in the singular; of everything else that it is a whole sentence."""
    for (name, verb), text in SAYS.items():
        if name != option:
            continue
        assert text.rstrip().endswith((".", ")", "…")), (verb, text)
        assert not text.startswith(("Of ", "Its ")), (verb, text)
        if GLOSSARY[option].kind in (*DIMENSIONS, "over length", "number"):
            meant, said = map(first_words, (GLOSSARY[option].meaning, SPECIAL.sub("", text)))
            assert said[: len(meant)] == meant, (verb, text)


def first_words(text):
    """Give the first two words, in small letters and in the singular."""
    return [word.lower().removesuffix("s") for word in re.findall(r"[\w:-]+", text)[:2]]


def test_the_page_of_options_is_of_these_options():
    made = make_options.page()
    assert (Path(make_options.__file__).with_name("options.md")).read_text("utf-8") == made, (
        "python docs/make_options.py"
    )
