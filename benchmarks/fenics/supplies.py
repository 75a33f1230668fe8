"""What is behind the terminals of a lever: the peer's measuring circuit."""

import numpy as np


class Supplies:
    """The equations a V + b I = e of all contacts, one potential V and one current I each.

    The swept supply is the first contact: V + R_s I = V_b.  The others are held: a voltage behind
    a resistor, a current, or ground behind a resistor.
    """

    def __init__(self, problem):
        circuit, terminals = problem["circuit"], problem["terminals"]
        self.names, equations = [circuit["swept"]], [(1.0, circuit["series_resistance_ohm"], 0.0)]
        self.grounds, self.senses = [], []
        for name, terminal in terminals.items():
            resistance = terminal["series_resistance_ohm"]
            if name == circuit["swept"]:
                continue
            if terminal["kind"] == "sense":
                self.senses.append(name)
            elif terminal["kind"] == "ground" and resistance == 0.0:
                self.grounds.append(name)
            else:
                self.names.append(name)
                if terminal["current_mA"] is not None:
                    equations.append((0.0, 1e3, terminal["current_mA"]))
                else:
                    equations.append((1.0, resistance, terminal["bias_V"] or 0.0))
        self.by_potential, resistance_ohm, self.held = np.array(equations).T
        self.by_current = resistance_ohm / 1e3  # kohm: volts of milliamperes

    def values(self, bias, share=1.0):
        """Return e with the swept supply at a bias [V] and the others at a share of theirs."""
        return np.concatenate([[bias], share * self.held[1:]])
