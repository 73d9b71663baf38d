"""The menu that shows and hides the tracks of others."""

from window_helpers import open_foam_document

from forcelab.gui.menus import ShownTracks
from forcelab.labels import Segment

HERS, HIS = (Segment(1, 2, "grab"),), (Segment(3, 4, "hold"),)


def entries(menu):
    menu.aboutToShow.emit()
    return {action.text(): action for action in menu.actions()}


def test_a_track_is_hidden_and_shown_again(app):
    with open_foam_document((), Ben=HERS, Cleo=HIS) as document:
        menu = ShownTracks(document)
        assert list(entries(menu)) == ["Ben", "Cleo"]
        entries(menu)["Ben"].trigger()
        assert document.other_tracks == {"Cleo": HIS}
        assert not entries(menu)["Ben"].isChecked()
        entries(menu)["Ben"].trigger()
        assert document.other_tracks == {"Ben": HERS, "Cleo": HIS}


def test_an_ampersand_in_a_name_is_no_mark_of_a_key(app):
    with open_foam_document((), **{"Ben & Cleo": HERS}) as document:
        (entry,) = entries(ShownTracks(document)).values()
        assert entry.text() == "Ben && Cleo"  # which Qt shows as one


def test_nobody_is_named_to_a_blind_coder(app):
    with open_foam_document((), Ben=HERS) as document:
        document.project.coding.assign(document.id, "Ann")
        document.reread()
        menu = ShownTracks(document)
        assert "Ben" not in entries(menu)
        assert not any(action.isEnabled() for action in menu.actions())
        document.set_done()
        assert list(entries(menu)) == ["Ben"]
