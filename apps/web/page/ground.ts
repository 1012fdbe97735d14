// The ground: its triangles, and a material that is drawn from the place in the world, so that no picture has to be loaded.

import { BufferAttribute, BufferGeometry, Mesh, MeshStandardMaterial } from "three";

export class Ground {
  readonly mesh = new Mesh(new BufferGeometry(), material());

  constructor() {
    this.mesh.receiveShadow = true;
    this.mesh.frustumCulled = false;
  }

  set(triangles: Float32Array): void {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(triangles, 3));
    geometry.computeVertexNormals();
    this.mesh.geometry.dispose();
    this.mesh.geometry = geometry;
  }
}

/** Paving of square meters, every other one darker, with joints between; steep faces darker, high ground lighter. */
function material(): MeshStandardMaterial {
  const made = new MeshStandardMaterial({ color: 0xb4bcc0, roughness: 0.95 });
  made.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", "#include <common>\nvarying vec3 vPlace;\nvarying float vSteep;")
      .replace("#include <begin_vertex>", "#include <begin_vertex>\nvPlace = position;\nvSteep = 1.0 - abs(normal.z);");
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", "#include <common>\nvarying vec3 vPlace;\nvarying float vSteep;")
      .replace(
        "#include <color_fragment>",
        `#include <color_fragment>
         vec2 width = fwidth(vPlace.xy);
         vec2 off = abs(fract(vPlace.xy - 0.5) - 0.5) / max(width, vec2(0.011));
         float far = clamp(2.0 * max(width.x, width.y), 0.0, 1.0);
         diffuseColor.rgb *= mix(0.74, 1.0, max(far, smoothstep(0.5, 1.5, min(off.x, off.y))));
         float other = mod(floor(vPlace.x) + floor(vPlace.y), 2.0);
         diffuseColor.rgb *= mix(1.0 - 0.09 * other, 0.955, far);
         diffuseColor.rgb *= 1.0 + 0.35 * clamp(vPlace.z, -0.5, 0.5);
         diffuseColor.rgb = mix(diffuseColor.rgb, diffuseColor.rgb * vec3(0.72, 0.66, 0.6), clamp(1.4 * vSteep, 0.0, 1.0));`,
      );
  };
  return made;
}
