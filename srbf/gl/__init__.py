"""Relighting on the GPU: the shader pack's include resolver, a headless OpenGL context, and the relighter.

moderngl is imported inside functions, so that every module here imports without it.
"""
