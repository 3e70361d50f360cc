"""Which format splats are saved in, who reads it, and what it cannot hold of them."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QCheckBox, QComboBox, QVBoxLayout, QWidget

from splap_editor.io.formats.table import FORMATS, SplatFormat
from splap_editor.io.ply import SplatFile
from splap_editor.io.splat_files import losses_of_saving
from splap_editor.session.jobs import Threads
from splap_editor.session.latest_job import LatestJob
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.number_field import set_tone
from splap_editor.ui.widgets.plain_text import PlainLabel

_AS_3DGS = "For programs that only know 3DGS: {0}"
_THIRD_SCALE = "add a thin third scale"
_PLAIN = "make a plain 3DGS file"
_MISREAD = (
    "{0}: read by this editor and the trainer's own viewer. SuperSplat, splat-transform and most others {1}; tick the "
    "box below for them."
)


def _misread(file: SplatFile) -> str:
    """Who reads a file's own layout, if it is not everybody."""
    if file.splats.n_scales == 2:
        return _MISREAD.format("Two scales per splat, as 2DGS trainers write", "want three")
    if file.layout.activated_opacity:
        return _MISREAD.format("Opacities themselves, as SpikingGS writes them", "take them for logits")
    if file.splats.filter_radii is not None:
        return _MISREAD.format("Scales without their 3-D filter, as GOF and RaDe-GS write", "do not apply it")
    return ""


_WORKING = "Working out what this format cannot hold…"


class FormatChoice(QWidget):
    """A list of formats, and under it what is to be known of the one chosen before anything is saved in it.

    What a format loses is worked out on a thread, once each; of formats chosen in quick succession only the last is.
    `chosen` tells a person's choice, which shows nothing by itself; `told` that more is known of the format shown.

    Parameters
    ----------
    file : SplatFile
        What is to be saved.
    threads : Threads
    of_ply : str
        What to say of a PLY.
    is_edited : bool
        Whether it is saved otherwise than it is.
    """

    chosen = Signal(str)
    told = Signal()

    def __init__(self, file: SplatFile, threads: Threads, of_ply: str, *, is_edited: bool) -> None:
        super().__init__()
        self._file, self._of_ply, self._is_edited = file, of_ply, is_edited
        self._misread = _misread(file)
        self._losses: dict[tuple[str, bool], list[str]] = {("ply", False): []}
        if file.splats.n_scales == 2:
            self._losses["ply", True] = []
        self._job = LatestJob(threads, "losses", cancels=True)
        self._shown = "", False
        self.field = QComboBox()
        for row in FORMATS.values():
            if row.can_be_written:
                self.field.addItem(f"{row.title} (*{row.suffixes[0]})", row.name)
        self.field.activated.connect(lambda index: self.chosen.emit(self.field.itemData(index)))
        self.facts = PlainLabel(wordWrap=True)
        self.facts.setProperty("tone", "quiet")
        self.losses = PlainLabel(wordWrap=True)
        way = _THIRD_SCALE if file.splats.n_scales == 2 else _PLAIN
        self.plain = QCheckBox(_AS_3DGS.format(way))
        self.plain.toggled.connect(lambda on: self.show_format(self.format))
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(2 * STEP)
        for widget in (self.field, self.facts, self.losses, self.plain):
            layout.addWidget(widget)
        self.show_format(FORMATS["ply"])

    @property
    def format(self) -> SplatFormat:
        """The format shown."""
        return FORMATS[self._shown[0]]

    @property
    def is_told(self) -> bool:
        """Whether it is said what the format shown loses."""
        return self._shown in self._losses

    @property
    def as_3dgs(self) -> bool:
        """Whether a PLY is written for programs that only know 3DGS."""
        return self._shown[1]

    def show_format(self, row: SplatFormat) -> None:
        """Say what there is to say of a format; what it loses as soon as that is known."""
        shown = row.name, bool(self._misread) and row.is_lossless and self.plain.isChecked()
        if shown == self._shown:
            return
        self._shown = shown
        self.field.setCurrentIndex(self.field.findData(row.name))
        self._job.drop()
        if not self.is_told:
            as_3dgs, is_edited = shown[1], self._is_edited
            self._job.ask(
                lambda job: losses_of_saving(
                    self._file, row, as_3dgs=as_3dgs, is_edited=is_edited, progress=job.progress("losses")
                ),
                lambda found: self._know(shown, found),
                # What cannot be told must not keep anybody from saving.
                failed=lambda error: self._know(shown, [f"What it loses could not be worked out: {error}"]),
            )
        self._show()

    def give_up(self) -> None:
        """Stop working out losses; nothing is told from then on."""
        self._job.drop()

    def _know(self, shown: tuple[str, bool], found: list[str]) -> None:
        self._losses[shown] = found
        self._show()

    def _show(self) -> None:
        row = self.format
        self.plain.setVisible(bool(self._misread) and row.is_lossless)
        lines = [f"Lost: {loss}" for loss in self._losses.get(self._shown, ())]
        if self._misread and row.is_lossless and not self.as_3dgs:
            lines = [self._misread]
        self.losses.setText("\n".join(lines) if self.is_told else _WORKING)
        set_tone(self.losses, "warning" if self.is_told else "quiet")
        self.losses.setVisible(bool(self.losses.text()))
        readers = f" Read by {row.readers}." if row.readers else ""
        self.facts.setText((self._of_ply if row.is_lossless else f"{row.title}.") + readers)
        self.told.emit()
