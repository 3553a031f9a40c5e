"""Parts that methods share when they encode a capture: model selection, light functions, quantization, UV seams, row blocks, dilation."""
