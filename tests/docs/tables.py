"""What to write where the documentation has a placeholder, how a run is made short, and who runs what cannot be run here in seconds.

A new command of `srbf` or a new script needs no line here: it is run unchanged, in the folder of `workplace.py`, which holds files of
the documented names. A line is needed for a placeholder that is no file's name, for what takes long, and for other programs.
"""

from __future__ import annotations

# A placeholder in capitals, also within a word (lightmap:OBJECT), or a whole word -> what is run in its place. A word of several parts
# becomes several words. Choices, A|B and [A], need no line: each is run.
STAND_INS = {
    "N": "2",
    "K": "2",
    "T": "exr",
    "DB": "20",
    "dB": "20",
    "BYTES": "16",
    "TARGET": "exr",
    "OBJECT": "Table",
    "CAMERA": "Camera",
    "METERS": "0.5",
    "LIGHTS": "--directional 0,0.5,1",
    "PATH": "asset",
    "FILE.lp": "dome/dirs.lp",
    "FILE.glb": "model.glb",
}

# The same in one script's calls alone.
STAND_INS_OF = {
    "benchmarks/direct.py": {"CAPTURE": "indirect"},  # it wants one whose direct light is apart
    "complete": {"CAPTURE": "quarter"},  # one whose lights have a share of the texels
}

# The tables below are by the words of a command: all of them, in any order, with ` *` at the end also among others.

# What is appended; the last value of a flag is the one that counts.
TESTED = "--validation 4 --holdout 2 --holdout-samples 1"
FEW = f"--lights 28 --size 24 --samples 1 {TESTED}"
SHORTER = {
    "srbf bake --light-set surfels *": f"--size 24 {TESTED} --surfels-per-m2 4",
    "srbf bake --light-set gather *": f"--size 24 {TESTED}",
    "srbf bake --light-set cubemap:32 *": "--light-set cubemap:8 --size 24 --validation 4 --holdout 2",
    "srbf bake --lights auto *": f"--size 24 {TESTED} --error 90%",
    "srbf bake *": FEW,
    "srbf demo --scene caustics *": "--lights 28",  # its scenes are made smaller, too
    "srbf demo --scene house *": "--lights 28",
    "srbf evaluate --leave-one-out *": "-k 4 --spread mean --ridge 0.1",
    "srbf evaluate --point-reference *": "--point-reference 2 --samples 1",
    "srbf fit --method neural-map *": "--steps 2",
    "srbf view *": "--port 0",
    "python benchmarks/fit.py *": "--lights 12 --side 16 -k 4 --rounds 1",
    "python benchmarks/motion.py *": "--lights 26",
    "python benchmarks/neural.py *": "--codes 2 --steps 2",
    "python benchmarks/pipeline.py *": "--lights 30 --side 16",
    "python benchmarks/shader.py *": "--sides 16 --runs 1 --point-lights 1",
}

# The test, or fixture, that runs the same. Flags of our own scripts and commands are checked all the same.
FARM, WEB = "tests/bake/test_farm.py", "tests/web/test_web_core.py"
ELSEWHERE = {
    "dask scheduler": f"{FARM}::test_dask_workers_bake_the_same_bits_though_one_is_killed",
    "dask worker *": f"{FARM}::test_dask_workers_bake_the_same_bits_though_one_is_killed",
    "srbf bake --dask *": f"{FARM}::test_dask_workers_bake_the_same_bits_though_one_is_killed",
    "srbf fit --dask *": f"{FARM}::test_dask_workers_fit_tiles",
    "mkdocs build *": "tests/packaging/test_docs_site.py::test_the_site_builds_without_a_warning",
    "openjd run *": f"{FARM}::test_an_openjd_job_bakes_the_same_bits_and_fits",
    "python -m blender_bake *": "tests/bake/test_end_to_end.py::test_scene_to_image",  # as every bake does
    "python -m scripts.gallery *": "tests/test_gallery.py::test_it_goes_on_after_a_kill",
    "python -m scripts.live_pages *": "tests/viewer/test_live_pages.py::test_demos_become_pages_and_a_list",
    "python benchmarks/torture.py *": "tests/bake/test_torture.py::test_nothing_is_lost",
    "python scripts/build_extension.py *": "tests/extension/test_zip.py::test_the_zip_builds_and_validates",
    "blender --python lights.py *": "tests/viewer/test_shot.py::test_the_script_makes_the_lights_in_blender",
    "blender --command srbf bake *": "tests/extension/test_extension.py::test_the_command_bakes_the_open_file",
    "blender --command srbf fit *": "tests/extension/test_extension.py::test_what_the_command_adds",
    "srbf demo --scene loft *": "tests/demo/test_lights_inside_demo.py::test_a_loft_from_script_to_picture",
    "srbf demo -o out/demo": "tests/demo/test_tour.py::test_all_scenes_can_be_opened_before_one_is_measured",
    "srbf demo -o FOLDER": "tests/demo/test_tour.py::test_all_scenes_can_be_opened_before_one_is_measured",
    "srbf view --scene *": "tests/extension/test_light_this_shot.py::test_a_true_shot_is_served",
    "srbf relight --scene-lights *": "tests/bake/test_scene_lights.py::test_relighting_by_them_is_what_cycles_renders",
    "srbf relight --scene-lights --reference *": "tests/bake/test_scene_lights.py::test_a_relit_picture_is_compared_with_cycles",
    "srbf view --profile *": "tests/viewer/test_gloss.py::test_the_command_takes_profiles",
    "srbf view --environment *": "tests/viewer/test_page.py::test_given_environments_shine_from_the_start",
    "srbf view --probes *": "tests/viewer/test_ball.py::test_the_command_takes_probes_with_it",
    "npm ci *": "tests/npm_package.py::npm",
    "npm test *": f"{WEB}::test_the_units_types_and_build_of_the_package_pass",
    "npm run check *": f"{WEB}::test_the_units_types_and_build_of_the_package_pass",
    "npm run build *": f"{WEB}::test_the_units_types_and_build_of_the_package_pass",
    "npm run build:viewer *": "tests/npm_package.py::viewer_page",
}

# Why nothing here runs it to its end. Flags of our own scripts, names of npm's scripts and the files named are checked all the same.
NOT_RUN = {
    "make check": "runs before the tests",
    "python benchmarks/choices.py": "fits glossy boards in a dozen ways: half a minute at its smallest",
    "python benchmarks/bake.py *": "four bakes and twelve fits of each scene, half a minute at their smallest",
    "python benchmarks/pca_visibility.py CAPTURE": "wants a capture of surfels with a scene to trace: a minute at its smallest",
    "python benchmarks/probes.py *": "renders spheres twice under each light: minutes",
    "python benchmarks/door.py *": "renders each step of a walk twice: minutes",
    "python benchmarks/environments.py *": "renders environments twice: minutes",
    "python benchmarks/emissive_objects.py *": "wants four bakes of a scene",
    "python benchmarks/lights_inside.py *": "renders lights of five kinds twice: minutes",
    "python benchmarks/deep_framebuffer.py *": "the same for a view",
    "python benchmarks/deep_framebuffer_paper.py *": "bakes a view twice, then renders lights of four kinds: minutes",
    "python benchmarks/deep_framebuffer_motion.py *": "wants a capture and an asset of a view, and relights hundreds of lights",
    "python -m scripts.gallery.shot": "bakes a view and renders three rigs of lights by Cycles: minutes",
    "python benchmarks/deep_framebuffer_passes.py *": "wants an asset of a view: half a minute at its smallest",
    "python benchmarks/transfer_frame.py *": "wants an asset of surfels: a minute at its smallest",
    "python benchmarks/transfer_paper.py *": "wants a capture of 40,000 surfels",
    "srbf bake SCENE -o C *": "stands for the scenes of a table; bakes of all light sets are run by tests/bake",
    "srbf fit C -o A *": "stands for the captures of a table; fits of them are run by tests/methods",
    "srbf bake shot.blend *": "a view's pool and links: tests/bake/test_gather_bakes.py runs smaller ones",
    "python benchmarks/web_environments.py *": "wants the page of the browser's tests, and an asset of a cubemap's directions",
    "srbf bake head.blend *": "37,000 vertices under 6144 directions: minutes; tests/bake/test_cubemap_bakes.py runs smaller ones",
    "srbf fit C/Figure *": "the same",
    "python benchmarks/sparse_gloss.py *": "the same as sparse.py, with gloss: minutes",
    "python benchmarks/sparse.py *": "traces every element of a figure and its ground, three times over: minutes",
    "srbf bake large.blend *": "60,000 vertices under 6144 directions: minutes; tests/bake/test_cubemap_bakes.py runs smaller ones",
    "srbf bake loft.blend *": "form factors of thousands of probes: a minute at its smallest",
    "python benchmarks/quality.py": "its own scene of 300 lights takes minutes",
    "python benchmarks/quality.py REALRTI": "fits again for each light left out: minutes for one small item",
    "python scripts/test_godot.py": "wants the chroot with Godot that scripts/godot-chroot makes, as root",
    "python scripts/test_godot_surfels.py": "the same",
    "python scripts/test_godot_probes.py": "the same",
    "godot *": "the same",
    "blender --command extension install-file *": "wants a Blender with a user's folder; the zip itself is built and validated by a test",
    "npm install *": "asks the registry",
    "npx vite": "a server of the project that the guide has one make",
}

# A span that begins with one of these shows a flag of another program.
OTHERS_FLAGS = {"--command": "Blender's"}
