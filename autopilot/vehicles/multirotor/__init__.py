"""The multirotor: three to eight rotors that push along one axis."""
