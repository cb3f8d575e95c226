"""Help of options that several commands have, made from models or not. Light to import."""

GUARD_SETTING = "Sets a number of the guard: NAME=VALUE (docs/reference/guard-settings.md). Repeatable."
