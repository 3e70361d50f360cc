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

_THIRD_SCALE = "Add a thin third scale, for programs that only know 3DGS"
_ONLY_2DGS = (
    "Two scales per splat, as 2DGS trainers write: read by 2DGS viewers and this editor. SuperSplat, splat-transform "
    "and most others want three; tick the box below for them."
)
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
    """

    chosen = Signal(str)
    told = Signal()

    def __init__(self, file: SplatFile, threads: Threads, of_ply: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._file, self._of_ply = file, of_ply
        self._is_flat = file.splats.n_scales == 2
        self._losses: dict[str, list[str]] = {FORMATS["ply"].name: []}
        self._job = LatestJob(threads, "losses", cancels=True)
        self._shown = ""
        self.field = QComboBox()
        for row in FORMATS.values():
            if row.can_be_written:
                self.field.addItem(f"{row.title} (*{row.suffixes[0]})", row.name)
        self.field.activated.connect(lambda index: self.chosen.emit(self.field.itemData(index)))
        self.facts = PlainLabel(wordWrap=True)
        self.facts.setProperty("tone", "quiet")
        self.losses = PlainLabel(wordWrap=True)
        self.third_scale = QCheckBox(_THIRD_SCALE)
        self.third_scale.toggled.connect(self._show)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(2 * STEP)
        for widget in (self.field, self.facts, self.losses, self.third_scale):
            layout.addWidget(widget)
        self.show_format(FORMATS["ply"])

    @property
    def format(self) -> SplatFormat:
        """The format shown."""
        return FORMATS[self._shown]

    @property
    def is_told(self) -> bool:
        """Whether it is said what the format shown loses."""
        return self.format.name in self._losses

    @property
    def as_3dgs(self) -> bool:
        """Whether a third scale is added."""
        return self._is_flat and self.format.is_lossless and self.third_scale.isChecked()

    def show_format(self, row: SplatFormat) -> None:
        """Say what there is to say of a format; what it loses as soon as that is known."""
        if row.name == self._shown:
            return
        self._shown = row.name
        self.field.setCurrentIndex(self.field.findData(row.name))
        self._job.drop()
        if not self.is_told:
            self._job.ask(
                lambda job: losses_of_saving(self._file, row, progress=job.progress("losses")),
                lambda found: self._know(row, found),
                # What cannot be told must not keep anybody from saving.
                failed=lambda error: self._know(row, [f"What it loses could not be worked out: {error}"]),
            )
        self._show()

    def give_up(self) -> None:
        """Stop working out losses; nothing is told from then on."""
        self._job.drop()

    def _know(self, row: SplatFormat, found: list[str]) -> None:
        self._losses[row.name] = found
        self._show()

    def _show(self) -> None:
        row = self.format
        self.third_scale.setVisible(self._is_flat and row.is_lossless)
        lines = [f"Lost: {loss}" for loss in self._losses.get(row.name, ())]
        if self._is_flat and row.is_lossless and not self.third_scale.isChecked():
            lines = [_ONLY_2DGS]
        self.losses.setText("\n".join(lines) if self.is_told else _WORKING)
        set_tone(self.losses, "warning" if self.is_told else "quiet")
        self.losses.setVisible(bool(self.losses.text()))
        readers = f" Read by {row.readers}." if row.readers else ""
        self.facts.setText((self._of_ply if row.is_lossless else f"{row.title}.") + readers)
        self.told.emit()
