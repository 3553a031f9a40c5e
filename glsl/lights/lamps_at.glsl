// SPDX-License-Identifier: MIT
/* srbfLampsAt: which of many lamps shine on a receiver, from where and how brightly.
   use:    int srbfLampsAt(vec4 lamps[4 * SRBF_LAMPS], int lampCount, vec3 receiver,
                           out vec4 directions[SRBF_LAMPS], out vec4 colors[SRBF_LAMPS])
   domain: lamps in fours as srbfUnpackLamp takes them, the first lampCount of them in use; receiver in their frame, metres; result:
           how many shine there. So many entries hold, in .xyz, the unit direction (0 where the receiver lies in the lamp) and colour
           times strength; the rest are 0. Lamps whose cone passes by are left out
   twin:   srbf.methods.receivers.light_vectors
   cite:   Wong2005, fig. 8 to 10 */
#include "lights/lamp_strength.glsl"
#include "lights/light_direction.glsl"
#include "lights/light_vector.glsl"
#include "lights/unpack_lamp.glsl"

#ifndef SRBF_LAMPS
#error define SRBF_LAMPS: how many lamps a pass takes at most
#endif

int srbfLampsAt(vec4 lamps[4 * SRBF_LAMPS], int lampCount, vec3 receiver,
                out vec4 directions[SRBF_LAMPS], out vec4 colors[SRBF_LAMPS]) {
    for (int j = 0; j < SRBF_LAMPS; ++j) {
        directions[j] = vec4(0.0);
        colors[j] = vec4(0.0);
    }
    int shining = 0;
    for (int j = 0; j < min(lampCount, SRBF_LAMPS); ++j) {
        SrbfLamp lamp = srbfUnpackLamp(lamps[4 * j], lamps[4 * j + 1], lamps[4 * j + 2], lamps[4 * j + 3]);
        vec3 lightVector = srbfLightVector(lamp.position, lamp.positionLow, receiver);
        float strength = srbfLampStrength(lamp, lightVector);
        if (strength > 0.0) {
            directions[shining] = vec4(srbfLightDirection(lightVector), 0.0);
            colors[shining] = vec4(lamp.color * strength, 0.0);
            ++shining;
        }
    }
    return shining;
}
