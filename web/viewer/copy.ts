/** Copies a texture into one of single floats, to keep it or to read it back. */
import { FloatType, GLSL3, Mesh, NearestFilter, NoBlending, OrthographicCamera, PlaneGeometry, RawShaderMaterial, RGBAFormat, Scene, type Texture, type WebGLRenderer, WebGLRenderTarget } from "three";

export class Copy {
  readonly target: WebGLRenderTarget;
  private readonly scene = new Scene();
  private readonly camera = new OrthographicCamera();
  private readonly material = new RawShaderMaterial({
    glslVersion: GLSL3,
    uniforms: { source: { value: null } },
    vertexShader: "in vec3 position; void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }",
    fragmentShader: `precision highp float;
precision highp sampler2D;
uniform sampler2D source;
out vec4 copied;
void main() { copied = texelFetch(source, ivec2(gl_FragCoord.xy), 0); }`,
    blending: NoBlending,
    depthTest: false,
    depthWrite: false,
  });

  constructor(width: number, height: number) {
    this.target = new WebGLRenderTarget(width, height, {
      type: FloatType,
      format: RGBAFormat,
      depthBuffer: false,
      magFilter: NearestFilter,
      minFilter: NearestFilter,
    });
    const quad = new Mesh(new PlaneGeometry(2, 2), this.material);
    quad.frustumCulled = false;
    this.scene.add(quad);
  }

  draw(renderer: WebGLRenderer, source: Texture): Texture {
    this.material.uniforms.source.value = source;
    renderer.setRenderTarget(this.target);
    renderer.render(this.scene, this.camera);
    renderer.setRenderTarget(null);
    return this.target.texture;
  }

  /** RGBA, in the texture's own order of rows. */
  read(renderer: WebGLRenderer, source: Texture): Float32Array {
    this.draw(renderer, source);
    const { width, height } = this.target;
    const data = new Float32Array(4 * width * height);
    renderer.readRenderTargetPixels(this.target, 0, 0, width, height, data);
    return data;
  }
}
