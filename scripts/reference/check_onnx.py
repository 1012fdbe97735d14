"""Checks an ONNX file with onnx's own checker and runs it in onnxruntime.

Usage: python3 check_onnx.py FILE.onnx [OBSERVATIONS.json ...]

Each OBSERVATIONS.json is an array of rows and makes one batch; all batches run in one session, so a file whose batch size is
not free fails at the second. Prints one JSON object: `onnx` and `onnxruntime` (versions), `inputs` and `outputs`
(name and shape), `metadata`, and `actions` (one array of rows a batch, f32 without loss). Ends with code 1 and the
checker's or the runtime's message if the file is not sound. Needs the packages numpy, onnx and onnxruntime.
"""

import json
import sys

import numpy as np
import onnx
import onnxruntime


def shapes(values):
    return [{"name": value.name, "type": value.type, "shape": value.shape} for value in values]


def check(path, observations):
    onnx.checker.check_model(path, full_check=True)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    (obs,) = session.get_inputs()
    actions = []
    for name in observations:
        with open(name, encoding="utf-8") as file:
            rows = np.array(json.load(file), dtype=np.float32)
        (batch,) = session.run(None, {obs.name: rows})
        # A double holds every single-precision number exactly.
        actions.append(batch.astype(np.float64).tolist())
    return {
        "onnx": onnx.__version__,
        "onnxruntime": onnxruntime.__version__,
        "inputs": shapes(session.get_inputs()),
        "outputs": shapes(session.get_outputs()),
        "metadata": session.get_modelmeta().custom_metadata_map,
        "actions": actions,
    }


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    try:
        result = check(sys.argv[1], sys.argv[2:])
    except Exception as error:  # both packages raise types of their own
        sys.exit(f"{sys.argv[1]}: {error}")
    json.dump(result, sys.stdout)


main()
