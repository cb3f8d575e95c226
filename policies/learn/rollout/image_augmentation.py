"""Images changed at random while a policy learns from them: a camera may show the same things otherwise.

In: sequences of images as bytes. Out: copies. One draw holds for a whole sequence, except for noise: a camera's
exposure and mount do not change from one image to the next.
"""

import torch
from torch import Tensor
from torch.nn import functional

from policies.learn.config.behavior import Augmentation


def augmented(images: Tensor, settings: Augmentation, generator: torch.Generator) -> Tensor:
    """Images shifted, brightened or darkened, and made noisy, as far as the settings ask for it.

    Args:
        images: shape (steps, sequences, height, width, channels) uint8; a channel called depth is the fourth.
        settings: how much of what.
        generator: of every draw.
    """
    if settings.shift_px:
        images = _shifted(images, settings.shift_px, generator)
    if not (settings.exposure or settings.noise):
        return images
    is_colour = torch.arange(images.shape[-1], device=images.device) < 3
    stops = settings.exposure * (torch.rand(images.shape[1], generator=generator, device=images.device) * 2.0 - 1.0)
    pixels = images.shape[2] * images.shape[3]
    gains = torch.where(is_colour, torch.exp2(stops)[:, None], 1.0).repeat(1, pixels)
    deviations = (settings.noise * is_colour).repeat(pixels)
    changed = torch.empty_like(images)
    for before, after in zip(images.flatten(2), changed.flatten(2), strict=True):  # step by step: caches are small
        floats = before * gains
        if settings.noise:
            floats.addcmul_(torch.randn(floats.shape, generator=generator, device=images.device), deviations)
        after.copy_(floats.add_(0.5).clamp_(0.0, 255.0))
    return changed


def _shifted(images: Tensor, most: int, generator: torch.Generator) -> Tensor:
    """Moved by up to so many pixels, the border repeated (Yarats et al. 2021, arXiv 2107.09645)."""
    steps, count, height, width, channels = images.shape
    planes = images.permute(1, 0, 4, 2, 3).reshape(count, steps * channels, height, width)
    padded = functional.pad(planes.float(), (most,) * 4, mode="replicate").to(torch.uint8)
    offsets = torch.randint(0, 2 * most + 1, (2, count), generator=generator, device=images.device)
    rows = offsets[0][:, None] + torch.arange(height, device=images.device)
    columns = offsets[1][:, None] + torch.arange(width, device=images.device)
    i = torch.arange(count, device=images.device)[:, None, None, None]
    j = torch.arange(steps * channels, device=images.device)[:, None, None]
    moved = padded[i, j, rows[:, None, :, None], columns[:, None, None, :]]
    return moved.view(count, steps, channels, height, width).permute(1, 0, 3, 4, 2)
