"""The recurrent part of a gated recurrent unit over whole sequences, forward and backward, in one compiled call each.

    r, z, g = three parts of W h + b,  h' = n + z (h - n),  n = tanh(i_n + r g),  r = sigmoid(i_r + r), z = sigmoid(i_z + z)

`workers.networks.description` has the formula, and a test compares the derivatives with autograd's. All arrays are float32
with contiguous rows; T steps of n sequences, m numbers of memory.
"""

import numpy as np

from workers.kernels.blas import multiply
from workers.kernels.dense import tanh, transpose
from workers.kernels.options import kernel

_ONE, _HALF = np.float32(1.0), np.float32(0.5)


@kernel(allocates=True)
def gru_forward(inputs, weight, bias, memory, keep, kept, remembered, gates, new, memories):
    """What is remembered after each step.

    Args:
        inputs: (T, n, 3 m), what comes in, behind its layer.
        weight: (3 m, m) of the memory's layer.
        bias: (3 m,) of it.
        memory: (n, m), from before the first step.
        keep: (T, n), 0 where an episode begins, else 1.
        kept: (T, n, m), written: memory as each step finds it.
        remembered: (T, n, 3 m), written: the memory's layer's outputs.
        gates: (T, n, 2 m), written: reset and update.
        new: (T, n, m), written: what would replace the memory.
        memories: (T, n, m), written: memory after each step.
    """
    steps, rows, size = memories.shape
    transposed = np.empty((size, 3 * size), np.float32)
    transpose(weight, transposed)
    before = memory
    for t in range(steps):
        for i in range(rows):
            for j in range(size):
                kept[t, i, j] = before[i, j] * keep[t, i]
        multiply(kept[t], False, transposed, False, remembered[t])
        for i in range(rows):
            for j in range(2 * size):
                remembered[t, i, j] += bias[j]
                # The sigmoid of x is (1 + tanh(x / 2)) / 2.
                gates[t, i, j] = _HALF * (inputs[t, i, j] + remembered[t, i, j])
            for j in range(2 * size, 3 * size):
                remembered[t, i, j] += bias[j]
        tanh(gates[t])
        for i in range(rows):
            for j in range(2 * size):
                gates[t, i, j] = _HALF + _HALF * gates[t, i, j]
            for j in range(size):
                new[t, i, j] = inputs[t, i, 2 * size + j] + gates[t, i, j] * remembered[t, i, 2 * size + j]
        tanh(new[t])
        for i in range(rows):
            for j in range(size):
                memories[t, i, j] = new[t, i, j] + gates[t, i, size + j] * (kept[t, i, j] - new[t, i, j])
        before = memories[t]


@kernel(allocates=True)
def gru_backward(grad_memories, weight, keep, kept, remembered, gates, new, grad_inputs, grad_remembered, grad_memory):
    """The derivatives of a scalar by what went in.

    Args:
        grad_memories: (T, n, m), its derivative by memory after each step where that was used.
        weight: as it was given to `gru_forward`, like `keep`; `kept` to `new` are what it wrote.
        keep: (T, n).
        kept: (T, n, m).
        remembered: (T, n, 3 m).
        gates: (T, n, 2 m).
        new: (T, n, m).
        grad_inputs: (T, n, 3 m), written: by what came in.
        grad_remembered: (T, n, 3 m), written: by the memory's layer's outputs.
        grad_memory: (n, m), written: by the memory from before the first step.
    """
    steps, rows, size = grad_memories.shape
    grad_memory[:] = 0
    for t in range(steps - 1, -1, -1):
        for i in range(rows):
            for j in range(size):
                grad_after = grad_memories[t, i, j] + grad_memory[i, j]
                reset, update, proposed = gates[t, i, j], gates[t, i, size + j], new[t, i, j]
                grad_new = grad_after * (_ONE - update) * (_ONE - proposed * proposed)
                grad_update = grad_after * (kept[t, i, j] - proposed) * update * (_ONE - update)
                grad_reset = grad_new * remembered[t, i, 2 * size + j] * reset * (_ONE - reset)
                grad_inputs[t, i, j] = grad_reset
                grad_inputs[t, i, size + j] = grad_update
                grad_inputs[t, i, 2 * size + j] = grad_new
                grad_remembered[t, i, j] = grad_reset
                grad_remembered[t, i, size + j] = grad_update
                grad_remembered[t, i, 2 * size + j] = grad_new * reset
                grad_memory[i, j] = grad_after * update
        multiply(grad_remembered[t], False, weight, True, grad_memory)
        for i in range(rows):
            for j in range(size):
                grad_memory[i, j] *= keep[t, i]
