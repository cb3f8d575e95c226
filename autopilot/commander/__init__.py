"""The commander: may the vehicle arm, which mode is it in, has it landed, what to do when something fails."""
