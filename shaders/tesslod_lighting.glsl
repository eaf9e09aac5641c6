// SPDX-License-Identifier: MIT
// OpenGL's fixed-function lighting and fog, evaluated per fragment from the fixed-function state.
//
// Shared text: pasted behind the #version line of the stages that need it, after tesslod_shadow.glsl.
//
// In: tessLodFixedFunction  what is enabled: bits 0–7 lights, bit 8 lighting, bit 9 local viewer,
//                           bits 10–11 fog (0 none, 1 linear, 2 exponential, 3 squared exponential), bit 12 two-sided

uniform int tessLodFixedFunction;

// The material's: of the back where lighting is two-sided and `isBack`, else of the front.
gl_MaterialParameters tessLodMaterial(bool isBack)
{
    if (isBack && (tessLodFixedFunction & 0x1000) != 0) { return gl_BackMaterial; }
    return gl_FrontMaterial;
}

// Light at eye-space `position` from light `k` with unit `normal` (eye space), seen from unit direction `toViewer`.
vec3 tessLodLightContribution(int k, vec3 position, vec3 normal, vec3 toViewer, gl_MaterialParameters material)
{
    vec3 toLight = gl_LightSource[k].position.xyz;
    float attenuation = 1.0;
    if (gl_LightSource[k].position.w != 0.0) {
        toLight = toLight / gl_LightSource[k].position.w - position;
        float d = length(toLight);
        attenuation = 1.0 / (gl_LightSource[k].constantAttenuation + gl_LightSource[k].linearAttenuation * d
                             + gl_LightSource[k].quadraticAttenuation * d * d);
    }
    toLight = dot(toLight, toLight) > 0.0 ? normalize(toLight) : toViewer;
    if (gl_LightSource[k].spotCutoff < 180.0) {
        float spot = dot(-toLight, normalize(gl_LightSource[k].spotDirection));
        bool inside = spot >= gl_LightSource[k].spotCosCutoff;
        attenuation *= inside ? pow(max(spot, 1e-6), gl_LightSource[k].spotExponent) : 0.0;
    }
    vec3 color = gl_LightSource[k].ambient.rgb * material.ambient.rgb;
    float lambert = dot(normal, toLight);
    if (lambert > 0.0) {
        color += gl_LightSource[k].diffuse.rgb * material.diffuse.rgb * lambert;
        float highlight = max(dot(normal, normalize(toLight + toViewer)), 0.0);
        float shine = material.shininess > 0.0 ? pow(max(highlight, 1e-6), material.shininess) : 1.0;
        color += gl_LightSource[k].specular.rgb * material.specular.rgb * shine;
    }
    return color * attenuation;
}

// Colour of the surface of `material` in the light and the shadow that there is; alpha is the diffuse one.
vec4 tessLodLitColor(vec3 position, vec3 normal, gl_MaterialParameters material)
{
    vec3 unlit = material.emission.rgb + gl_LightModel.ambient.rgb * material.ambient.rgb;
    if ((tessLodFixedFunction & 0x100) == 0) { return tessLodShadowedColor(material.diffuse, unlit, position); }
    vec3 toViewer = (tessLodFixedFunction & 0x200) != 0 ? normalize(-position) : vec3(0.0, 0.0, 1.0);
    vec3 color = unlit;
    for (int k = 0; k < 8; ++k) {
        if ((tessLodFixedFunction & (1 << k)) != 0) {
            color += tessLodLightContribution(k, position, normal, toViewer, material);
        }
    }
    return tessLodShadowedColor(vec4(clamp(color, 0.0, 1.0), material.diffuse.a), unlit, position);
}

// `color` as the fog between the eye and eye-space `position` leaves it.
vec4 tessLodFoggedColor(vec4 color, vec3 position)
{
    int mode = (tessLodFixedFunction >> 10) & 3;
    if (mode == 0) { return color; }
    float d = abs(position.z);
    float clearness = mode == 1 ? (gl_Fog.end - d) * gl_Fog.scale
                    : mode == 2 ? exp(-gl_Fog.density * d)
                                : exp(-gl_Fog.density * gl_Fog.density * d * d);
    return vec4(mix(gl_Fog.color.rgb, color.rgb, clamp(clearness, 0.0, 1.0)), color.a);
}
