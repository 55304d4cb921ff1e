"""Compares the optima and writes the table. See run.sh."""

import json
import platform
import sys

title, *files = sys.argv[1:]
rows = [json.loads(line) for file in files for line in open(file)]
problem = next(row for row in rows if row["side"] == "problem")
sides = [row for row in rows if row["side"] != "problem"]
ours = next(row for row in sides if row["side"] == "trueline")
print(f"### {title}\n")
print(f"{problem['features']} features, {problem['unknowns']} unknowns, one thread.\n")
print("| solver | steps | time to the optimum | times trueline's | optimum is off by |")
print("|---|---|---|---|---|")
worst = 0.0
for row in sides:
    off = max(abs(a - b) / s for a, b, s in zip(row["found"], ours["found"], problem["sigma"]))
    worst = max(worst, off)
    steps = row["iterations"] or "–"
    print(f"| {row['side']} | {steps} | {row['seconds'] * 1e3:.2f} ms | {row['seconds'] / ours['seconds']:.1f} | {off:.1e} σ |")
print()
# A side may not take a last step whose gain is lost in the rounding of its sum: it then ends some 1e-5 sigma away.
if worst > 1e-4:
    sys.exit(f"the optima differ by {worst:.1e} sigma")
