// Preact and htm, from one place: a view is a function from values to markup.
export {
  html,
  render,
  createContext,
  useContext,
  useEffect,
  useErrorBoundary,
  useLayoutEffect,
  useMemo,
  useReducer,
  useRef,
  useState,
} from "../../vendor/htm/standalone.module.js";
