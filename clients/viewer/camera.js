// SPDX-License-Identifier: MIT
// The camera as a person moves it: a target, a distance and two angles. +Y is up, metres, degrees.
import { add, clamp, cross, dot, middleOf } from "./transforms.js";

const UP_LIMIT_DEG = 89.9; // straight up or down, left and right would have no meaning
const RAD = Math.PI / 180;
const DEFAULT_FOV_DEG = 45;

/** Directions from the target to the eye, as {yaw, pitch} in degrees. */
export const STANDARD_VIEWS = {
  front: { yaw: 0, pitch: 0 },
  right: { yaw: 90, pitch: 0 },
  back: { yaw: 180, pitch: 0 },
  left: { yaw: -90, pitch: 0 },
  top: { yaw: 0, pitch: UP_LIMIT_DEG },
  bottom: { yaw: 0, pitch: -UP_LIMIT_DEG },
  iso: { yaw: 45, pitch: 35.264 }, // arctan(1/sqrt 2): all three axes equally foreshortened
  "three-quarter": { yaw: 35, pitch: 20 }, // as products are photographed
};

export class OrbitCamera {
  target = [0, 0, 0];
  distance = 5;
  yaw = 0; // about +Y; 0 looks along -Z
  pitch = 0; // above the horizon
  fov = DEFAULT_FOV_DEG;
  isOrthographic = false;
  sceneSize = 1; // metres; what "far" and "near" mean here

  /** From the target to the eye. */
  get backward() {
    const [yaw, pitch] = [this.yaw * RAD, this.pitch * RAD];
    return [Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch), Math.cos(yaw) * Math.cos(pitch)];
  }

  get right() {
    return [Math.cos(this.yaw * RAD), 0, -Math.sin(this.yaw * RAD)];
  }

  get up() {
    return cross(this.backward, this.right);
  }

  get eye() {
    return add(this.target, this.backward, this.distance);
  }

  /** Metres that the picture's height covers at the target. */
  get height() {
    return 2 * this.distance * Math.tan((this.fov * RAD) / 2);
  }

  orbit(yaw, pitch) {
    this.yaw = ((this.yaw + yaw + 540) % 360) - 180;
    this.pitch = clamp(this.pitch + pitch, -UP_LIMIT_DEG, UP_LIMIT_DEG);
  }

  /** Shares of the picture's height to the right and up. */
  pan(right, up) {
    this.target = add(add(this.target, this.right, right * this.height), this.up, up * this.height);
  }

  /** Below 1 comes nearer; at the target, goes on through it. */
  zoom(factor) {
    const wanted = this.distance * factor;
    const least = 2e-3 * this.sceneSize;
    const isThrough = factor < 1 && wanted < least && !this.isOrthographic;
    if (isThrough) this.target = add(this.target, this.backward, wanted - this.distance);
    else this.distance = clamp(wanted, 1e-6 * this.sceneSize, 1e3 * this.sceneSize);
  }

  /** Metres along the own axes; the target comes along. */
  fly(right, up, forward) {
    this.target = add(this.target, this.right, right);
    this.target = add(this.target, [0, 1, 0], up);
    this.target = add(this.target, this.backward, -forward);
  }

  turnTo({ yaw, pitch }) {
    [this.yaw, this.pitch] = [yaw, pitch];
  }

  /** Puts a box in the middle, all of its sphere in view. bounds: least x y z, greatest x y z. */
  fit(bounds, aspect) {
    const least = bounds.slice(0, 3);
    const most = bounds.slice(3);
    const radius = Math.max(Math.hypot(...add(most, least, -1)) / 2, 1e-6);
    const half = (this.fov * RAD) / 2;
    const narrow = Math.min(half, Math.atan(Math.tan(half) * aspect));
    this.target = add(least, most).map((value) => value / 2);
    this.distance = radius / Math.sin(narrow);
  }

  /**
   * Stands where a camera of the scene stands. From outside it turns around the middle of the
   * scene's box; inside, as in a room, around a point `near` metres away: nearly on the spot.
   * A picture (pictureAspect: width over height) that is narrower than the camera's shows all its
   * width, as the service does where the camera is called by its node.
   */
  standAt({ matrix, fov_y_deg, ortho_height, aspect = 0 }, bounds, near, pictureAspect) {
    const eye = matrix.slice(12, 15);
    const backward = matrix.slice(8, 11);
    const center = middleOf(bounds);
    const isInside = eye.every((value, axis) => value > bounds[axis] && value < bounds[axis + 3]);
    const depth = isInside ? 0 : dot(add(eye, center, -1), backward);
    const least = isInside ? near : 0.05 * this.sceneSize;
    this.pitch = clamp(Math.asin(clamp(backward[1], -1, 1)) / RAD, -UP_LIMIT_DEG, UP_LIMIT_DEG);
    this.yaw = Math.atan2(backward[0], backward[2]) / RAD;
    this.isOrthographic = ortho_height !== undefined;
    const wider = Math.max(aspect / pictureAspect, 1);
    this.fov = this.isOrthographic
      ? DEFAULT_FOV_DEG
      : 2 * Math.atan(wider * Math.tan(((fov_y_deg ?? DEFAULT_FOV_DEG) * RAD) / 2)) / RAD;
    this.distance = this.isOrthographic
      ? wider * ortho_height / 2 / Math.tan((this.fov * RAD) / 2)
      : Math.max(depth, least);
    this.target = add(eye, this.backward, -this.distance);
  }

  /** The point of the plane through the target that faces us, under a point of the picture, whose
   * x and y go from -0.5 to 0.5 (y up), in units of the height. */
  pointAt(x, y) {
    return add(add(this.target, this.right, x * this.height), this.up, y * this.height);
  }

  /**
   * Where a point of the world is in a picture of that aspect: shares of its sides from the upper
   * left corner, and the height of the picture there in metres. Null behind the eye.
   */
  project(point, aspect) {
    const offset = add(point, this.eye, -1);
    const depth = -dot(offset, this.backward);
    if (depth <= 0 && !this.isOrthographic) return null;
    const height = this.isOrthographic ? this.height : (this.height * depth) / this.distance;
    return { x: 0.5 + dot(offset, this.right) / height / aspect,
      y: 0.5 - dot(offset, this.up) / height, height };
  }

  /** The ray through such a point of the picture: where it begins and its unit direction. */
  rayAt({ x, y }, aspect) {
    const through = this.pointAt((x - 0.5) * aspect, 0.5 - y);
    if (this.isOrthographic)
      return { origin: add(through, this.backward, this.sceneSize), direction: this.backward.map((v) => -v) };
    const way = add(through, this.eye, -1);
    return { origin: this.eye, direction: way.map((value) => value / Math.hypot(...way)) };
  }

  /** As a request says it. */
  toRequest() {
    const camera = { eye: this.eye, target: [...this.target], up: [0, 1, 0], fov_y_deg: this.fov };
    if (this.isOrthographic) {
      camera.ortho_height = this.height;
      camera.eye = add(this.target, this.backward, this.distance + this.sceneSize); // outside it all
    }
    return camera;
  }

  /** For links: all digits, so that fromState brings back the same camera and the same picture. */
  toState() {
    return [...this.target, this.distance, this.yaw, this.pitch, this.fov,
      this.isOrthographic ? 1 : 0];
  }

  fromState(state) {
    if (!Array.isArray(state) || state.length !== 8 || !state.every(Number.isFinite)) return false;
    this.target = state.slice(0, 3);
    [this.distance, this.yaw, this.pitch, this.fov] = state.slice(3);
    this.isOrthographic = state[7] === 1;
    return true;
  }
}
