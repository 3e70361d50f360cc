"""What a colour grade changes: one option each, at rest by default. Nothing here needs numbers in bulk."""

from dataclasses import dataclass

from splap_editor.core.options import check_options, option


@dataclass(frozen=True)
class GradeOptions:
    """One colour grade; in the order in which it is applied: white balance, exposure, contrast, hue, saturation."""

    exposure: float = option(
        0.0, "Brighter by so many stops of light; darker below 0.", label="Exposure", least=-5.0, most=5.0, step=0.1
    )
    contrast: float = option(
        1.0, "How far colours lie from middle grey.", label="Contrast", least=0.0, most=4.0, is_percent=True, step=0.05
    )
    saturation: float = option(
        1.0, "How far colours lie from their grey.", label="Saturation", least=0.0, most=4.0, is_percent=True, step=0.05
    )
    hue: float = option(
        0.0, "Turns colours about grey, in degrees: red to green to blue.", label="Hue", least=-180.0, most=180.0
    )
    temperature: float = option(
        0.0, "White balance: warmer above 0, cooler below.", label="Temperature", least=-1.0, most=1.0, step=0.05
    )
    tint: float = option(
        0.0, "White balance: to magenta above 0, to green below.", label="Tint", least=-1.0, most=1.0, step=0.05
    )
    opacity: float = option(
        1.0,
        "So many times as opaque; above 1, as that many layers of the splat.",
        label="Opacity",
        least=0.0,
        most=4.0,
        is_percent=True,
        step=0.05,
    )
    falloff: float = option(
        0.0,
        "Fades out along the surface over this length about what is graded, in the file's units.",
        label="Falloff",
        least=0.0,
        unit="world",
        decimals=4,
    )

    def __post_init__(self) -> None:
        check_options(self)

    @property
    def is_identity(self) -> bool:
        """Whether nothing looks any different."""
        return self == GradeOptions(falloff=self.falloff)
