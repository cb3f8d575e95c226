"""The navigator: what each flight mode asks of the control part, frame by frame."""
